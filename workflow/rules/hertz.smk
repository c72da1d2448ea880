# Section 5.1: the Hertz model and its tables.

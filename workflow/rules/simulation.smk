# Sections 3.3.2 to 3.3.4: the simulated block, the linear method and the error minimisation.

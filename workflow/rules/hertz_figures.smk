# Figures of Section 5.1, Appendix A and the diagrams of Chapter 3.

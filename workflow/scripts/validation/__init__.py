"""Compares results with the lab's truth: randomised rigs, and one indentation by many protocols."""

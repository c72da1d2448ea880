"""The study's tracker (Section 4.3): the template deformed by translations of its vertices."""

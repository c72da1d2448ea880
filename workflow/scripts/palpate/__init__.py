"""Palpate: elastic moduli of soft objects from one depth camera and a hand-held force probe."""

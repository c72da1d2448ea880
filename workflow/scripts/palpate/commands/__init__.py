"""The verbs of the command ``palpate``, one module each."""

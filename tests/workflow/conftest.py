"""What the tests that run scripts by themselves share."""

import logging

import pytest


@pytest.fixture(autouse=True)
def handlers():
    """Scripts take the root logger over; its handlers' streams are closed afterwards."""
    logger = logging.getLogger()
    kept, level = logger.handlers[:], logger.level
    yield
    logger.handlers[:] = kept
    logger.setLevel(level)

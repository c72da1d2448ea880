"""The corpus of ``make mutations``, which runs by itself after the tests."""

from spoilt.corpus import corpus, drawn


def test_there_are_many_and_the_same_are_drawn_again():
    mutations = [one.key for one in corpus()]
    assert len(set(mutations)) == len(mutations) > 1500
    assert drawn(mutations, 5, seed=3) == drawn(mutations, 5, seed=3)

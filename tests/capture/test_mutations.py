"""Some of the mutations of ``make mutations``: each ends with a clear line or a right result."""

import pytest
from mutants.corpus import corpus, drawn
from mutants.judge import judge, right_moduli, warm_up
from mutants.place import make_bases

KINDS = ("picture", "background", "table", "YAML", "name", "template", "field")
COUNT, SEED = 60, 20
# Numbers that a schema takes and only the jobs can refuse.
DEEP = {
    "physics: wrench in mN and mNm": "at most 500 N from a hand",
    "physics: sign flipped": "along the probe, found it 17",
    "physics: torque in mNm": "of the sphere's centre",
}
MUTATIONS = {one.key: one for one in corpus()}
SHALLOW = drawn([one for one in MUTATIONS.values() if one.kind in KINDS], COUNT, seed=SEED)


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    return tmp_path_factory.mktemp("mutations")


@pytest.fixture(scope="module")
def bases(work):
    made = make_bases(work)
    warm_up(made[True])
    return made


@pytest.fixture(scope="module")
def right(bases, work):
    return right_moduli({False: bases[False]}, work)[False]


def test_there_are_many_and_the_same_are_drawn_again():
    assert len(MUTATIONS) > 1000
    assert drawn(list(MUTATIONS), 5, seed=3) == drawn(list(MUTATIONS), 5, seed=3)


@pytest.mark.parametrize("mutation", SHALLOW, ids=lambda one: ascii(one.key)[:60])
def test_the_check_says_it_or_lets_it_pass(mutation, bases, work):
    verdict = judge(mutation, bases[mutation.volts], work, None, check_only=True)
    assert verdict.good, f"{verdict.outcome}: {verdict.line}"


@pytest.mark.parametrize("name", DEEP)
def test_a_plausible_wrong_number_is_refused_by_its_job(name, bases, work, right):
    mutation = MUTATIONS[name]
    verdict = judge(mutation, bases[mutation.volts], work, right)
    assert verdict.outcome == "refused by a job", f"{verdict.outcome}: {verdict.line}"
    assert DEEP[name] in verdict.line

"""How long a run still takes, by its last benchmarks and its own pace."""

from types import SimpleNamespace

import pytest
from palpate.run.pace import Pace, benchmark_s, pace_of, told_left


def bench(folder, name, seconds):
    path = folder / f"{name}.tsv"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"s\th:m:s\tmax_rss\n{seconds}\t0:00:01\t-\n")
    return path


def job(number, rule, path):
    return SimpleNamespace(jobid=number, rule=SimpleNamespace(name=rule), benchmark=path)


def test_jobs_last_as_long_as_before_and_new_ones_as_those_of_their_rule(tmp_path):
    first, second = bench(tmp_path, "clouds/a", 10.0), bench(tmp_path, "clouds/b", 30.0)
    bench(tmp_path, "gone/x", 1e6)
    jobs = [
        job(1, "clouds", first),
        job(2, "clouds", second),
        job(3, "clouds", tmp_path / "clouds/c.tsv"),
        job(4, "track", tmp_path / "track/a.tsv"),
        job(5, "all", None),
    ]
    pace = pace_of(jobs, benchmarks=tmp_path, cores=None)
    # The mean of 10, 30 and 20 s; what only gathers files takes nothing.
    assert pace.expected_s == {1: 10.0, 2: 30.0, 3: 20.0, 4: 20.0}
    assert pace.measured and pace.cores == 1


def test_without_a_last_run_all_steps_are_alike_and_the_first_tell(tmp_path):
    jobs = [job(k, "clouds", tmp_path / f"clouds/{k}.tsv") for k in range(40)]
    pace = pace_of(jobs, benchmarks=tmp_path, cores=2)
    assert not pace.measured
    assert pace.left_s(set(), 5.0) is None and pace.left_s({0}, 5.0) is None
    assert pace.left_s(set(range(10)), 100.0) == pytest.approx(300.0)


def test_before_the_first_job_is_done_the_last_run_tells():
    pace = Pace({1: 600.0, 2: 200.0}, measured=True, cores=2)
    assert pace.left_s(set(), 0.0) == pytest.approx(400.0)
    assert pace.left_s({1, 2}, 500.0) == 0


def test_a_slower_machine_is_told_by_its_first_jobs():
    pace = Pace({k: 10.0 for k in range(100)}, measured=True)
    slow = [pace.left_s(set(range(done)), 30.0 * done) for done in (1, 50, 90)]
    # At its own pace 2970, 1500 and 300 s; before the first jobs 990.
    assert 1000 < slow[0] < 1300 and 1300 < slow[1] < 1500 and 270 < slow[2] < 300


def test_nothing_to_do_says_nothing():
    assert Pace({}, measured=False).left_s(set(), 1.0) is None


@pytest.mark.parametrize("text", ["", "s\th:m:s\n", "h:m:s\n0:00:01\n", "s\nNA\n", "s\nnan\n"])
def test_a_benchmark_without_a_time_is_as_none(tmp_path, text):
    path = tmp_path / "clouds.tsv"
    path.write_text(text)
    assert benchmark_s(path) is None and benchmark_s(tmp_path / "none.tsv") is None


def test_minutes_are_told_up():
    assert told_left(61.0) == ", about 2 min left"
    assert told_left(60.0) == ", less than a minute left" == told_left(0.0)

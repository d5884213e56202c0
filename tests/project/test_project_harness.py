"""The harness of the benchmarks: the order of the runs, and the comparisons."""

import pytest

from benchmarks import bridge, harness
from benchmarks.harness import Comparison, Contender, compare


def contender(name: str, calls: list[str], figures: list[float]) -> Contender:
    left = iter(figures)

    def run() -> dict[str, float]:
        calls.append(name)
        return {"cpu (us)": next(left)}

    return Contender(name, run)


def compared() -> tuple[Comparison, list[str]]:
    calls: list[str] = []
    a = contender("a", calls, [1.0, 2.0, 100.0])
    b = contender("b", calls, [3.0, 6.0, 300.0])
    return compare("a title", [a, b], rounds=3), calls


def test_every_other_round_runs_the_contenders_in_reverse_order() -> None:
    assert compared()[1] == ["a", "b", "b", "a", "a", "b"]


def test_ratios_are_taken_within_a_round_so_a_slow_round_does_not_change_them() -> None:
    assert compared()[0].ratios("b", "cpu (us)") == [3.0, 3.0, 3.0]


def test_the_median_is_taken_over_all_rounds() -> None:
    assert compared()[0].median("a", "cpu (us)") == 2.0


def test_the_table_shows_medians_and_ratios() -> None:
    assert "| cpu (us) | 2 | 6 (3.00 x, 3.00 to 3.00) |" in compared()[0].table()


def test_no_round_begins_that_would_end_too_late(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(harness, "MOST_SECONDS", 0.0)
    calls: list[str] = []
    compare("a title", [contender("a", calls, [1.0] * 9)], rounds=9)
    assert calls == ["a"]


def test_zero_rounds_are_refused() -> None:
    with pytest.raises(ValueError, match="got 0 rounds"):
        compare("a title", [], rounds=0)


@pytest.mark.serial
@pytest.mark.slow
def test_the_bridge_benchmark_runs_and_measures_every_contender() -> None:
    odometry, scans = bridge.bench(rounds=1, quick=True)
    python = {"libraries", "webmap", "roslibpy"}
    assert set(odometry.runs) - set(bridge.NODE) == python
    assert set(scans.runs) - set(bridge.NODE) == {*python, "webmap-json"}
    for (figures,) in (*odometry.runs.values(), *scans.runs.values()):
        assert all(value > 0 for value in figures.values()), figures

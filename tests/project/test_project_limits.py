"""The ends of the ramps of robots, and peers that are not installed."""

from benchmarks import peers
from benchmarks.limits import AGE_99, Watch, end_of, plot, ramp
from equipment.gate_reports import robot_report


def ages(**by_count):
    def measure(count, _seconds):
        return {AGE_99: by_count[f"n{count}"]}

    return measure


def test_a_ramp_ends_with_the_first_number_of_robots_that_is_too_many():
    found = ramp("t", ages(n1=20.0, n2=151.0), [1, 2, 3], 0.0)
    assert list(found.runs) == ["1 robots", "2 robots"]
    assert end_of(found).endswith("older than 150 ms between 1 and 2 robots")


def test_poses_that_do_not_come_are_too_old():
    found = ramp("t", ages(n1=20.0, n2=float("nan")), [1, 2, 3], 0.0)
    assert end_of(found).endswith("between 1 and 2 robots")


def test_a_ramp_without_an_end_names_its_last_number():
    found = ramp("t", ages(n1=20.0, n2=30.0), [1, 2], 0.0)
    assert end_of(found).endswith("above 2")


def test_a_ramp_ends_where_nothing_can_be_measured_any_more():
    def measure(count, _seconds):
        if count > 1:
            raise RuntimeError("the viewers saw no frame")
        return {AGE_99: 20.0}

    found = ramp("t", measure, [1, 2, 3], 0.0)
    assert end_of(found).endswith("between 1 and 2 robots")


def test_the_plot_has_the_ages_of_each_ramp():
    found = ramp("t", ages(n1=20.0, n2=30.0), [1, 2], 0.0)
    (curve,) = plot([found]).curves
    assert list(curve.points) == [(1, 20.0), (2, 30.0)]


def test_an_age_of_the_gate_counts_once_for_each_message():
    watch = Watch()
    for measured in ((2.0,), (2.0,), None, (2.1,)):
        watch.note(robot_report(measured=measured))
    assert len(watch.ages) == 2


def test_a_peer_that_is_not_installed_is_left_out_with_what_installs_it(
    monkeypatch, tmp_path, capsys
):
    monkeypatch.setattr(peers, "PYTHON", tmp_path / "python")
    monkeypatch.setattr(peers, "SCRIPTS", (tmp_path / "ros2d.js",))
    monkeypatch.setattr(peers, "compare", lambda _title, found, _rounds: found)
    (contenders,) = peers.bench(rounds=1, quick=True)
    assert [contender.name for contender in contenders] == ["WebMap"]
    output = capsys.readouterr().out
    assert all(name in output for name in ("nicegui", "viser", "ros2d"))
    assert output.count("make bench-peers") == 3

"""Regular checks of all robots use few timers and leave out no robot."""

import asyncio

import pytest
from pose_script import CountingLoop

from webmap.base.audience import RARELY, audience
from webmap.core.robot_state import AT_ONCE, EVERY, StateRounds


@pytest.fixture(autouse=True)
def somebody_looks():
    yield
    audience._set(True)


def run(scenario):
    with asyncio.Runner(loop_factory=CountingLoop) as runner:
        runner.run(scenario())


class Looks:
    """Counts the checks of some robots."""

    def __init__(self, rounds, robots):
        self.counts = [0] * robots
        self.looks = [lambda n=n: self.look(n) for n in range(robots)]
        assert all([rounds.join(look) for look in self.looks])

    def look(self, number):
        self.counts[number] += 1


@pytest.mark.parametrize(("somebody", "every"), [(True, EVERY), (False, RARELY / 1000)])
@pytest.mark.parametrize("robots", [1, AT_ONCE, AT_ONCE + 1, 10 * AT_ONCE])
def test_each_robot_is_looked_at_regularly_with_few_timers(somebody, every, robots):
    async def scenario():
        audience._set(somebody)
        looks = Looks(StateRounds(), robots)
        loop = asyncio.get_running_loop()
        await asyncio.sleep(2 * every)  # the first round
        before, loop.timers = looks.counts[:], 0
        await asyncio.sleep(20 * every)
        increases = [now - then for now, then in zip(looks.counts, before, strict=True)]
        assert min(increases) >= 19
        assert max(increases) <= 21
        assert loop.timers <= 20 * max(1, robots / AT_ONCE) + 3

    run(scenario)


def test_who_begins_to_look_waits_no_longer_for_the_next_round():
    async def scenario():
        audience._set(False)
        looks = Looks(StateRounds(), 2)
        await asyncio.sleep(0.1)
        audience._set(True)
        await asyncio.sleep(EVERY + 0.01)
        assert looks.counts == [1, 1]

    run(scenario)


def test_a_look_that_fails_ends_no_other(caplog):
    async def scenario():
        rounds = StateRounds()
        looks = Looks(rounds, 1)
        rounds.join(lambda: 1 / 0)
        looks_after = Looks(rounds, 1)
        await asyncio.sleep(2 * EVERY + 0.01)
        assert looks.counts == looks_after.counts == [2]

    run(scenario)
    assert "the state of a robot was not updated" in caplog.text


def test_a_robot_that_leaves_or_joins_during_a_look_is_heeded():
    async def scenario():
        rounds, later = StateRounds(), []
        gone = Looks(rounds, 0)

        def look():
            rounds.leave(look)
            rounds.leave(gone.look)
            later.append(Looks(rounds, 1))

        rounds.join(look)
        rounds.join(gone.look)
        loop = asyncio.get_running_loop()
        await asyncio.sleep(EVERY + 0.01)
        loop.timers = 0
        await asyncio.sleep(10 * EVERY)
        (joined,) = later
        assert joined.counts[0] in (10, 11)
        assert loop.timers <= 11
        rounds.leave(joined.looks[0])
        rounds.leave(joined.looks[0])
        assert rounds._timer is None

    run(scenario)


def test_looks_go_on_in_the_next_loop_and_need_one():
    rounds = StateRounds()
    assert not rounds.join(print)

    async def scenario():
        looks = Looks(rounds, 1)
        await asyncio.sleep(EVERY + 0.01)
        assert looks.counts == [1]

    run(scenario)
    audience._set(False)
    audience._set(True)  # the loop has ended
    run(scenario)

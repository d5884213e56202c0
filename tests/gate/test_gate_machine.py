"""No sequence of events breaks one of eight safety promises.

1. A velocity is written only in answer to a command of the holder that was accepted
   just now. When the newest such command is older than the limit, only zero is written,
   or nothing. (The stop test creeps in answer to released inputs.)
2. Between two epochs in the log of a robot there is a zero.
3. No velocity of an old epoch comes after one of a newer epoch.
4. No velocity exceeds the limit in force.
5. After half a second of zeros nothing is sent, unless a STOP is active.
6. After a STOP only zeros are written, no goal is sent, and no user has control, until
   a reset that names the newest STOP. This holds also when the gate is killed and
   restarted in between.
7. A reset writes nothing.
8. While control changes and odometry shows motion, no user has control.

In addition, after any doubt about the inputs the robot does not move before the gate
has received released inputs.
"""

import os
from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from machine_bench import PacedBench

from equipment.gate_harness import KEY, URL, spec
from webmap.base.geometry import Twist
from webmap.gate import actions, commands, events, protocol
from webmap.gate.events import Press
from webmap.gate.process import STEP
from webmap.gate.protocol import PROGRAM
from webmap.gate.rules.connections import Epochs, Ticks
from webmap.gate.rules.gate import Gate
from webmap.gate.rules.motion import DEADMAN

pytestmark = pytest.mark.slow

PEOPLE = ("a", "b")
LATE = STEP + 1e-4
"""One step of the gate's loop, in seconds."""


@dataclass
class Sent:
    at: float
    who: str
    epoch: int
    neutral: bool
    valid: bool


class Motion(RuleBasedStateMachine):
    @initialize(odometry=st.booleans(), a_max=st.sampled_from([None, 0.5]))
    def begin(self, odometry, a_max):
        self.odometry = "/odom" if odometry else None
        self.a_max = a_max
        self.v_max = 1.0
        self.bench = PacedBench()
        self.bench.begin(self._spec())
        self.sent: list[Sent] = []
        self.doubts = [self.bench.now]
        """The times after which the gate must receive released inputs again."""
        self.speeds = dict.fromkeys((*PEOPLE, PROGRAM), 9.0)
        self.last_seq = dict.fromkeys(PEOPLE, -1)
        self.seeing = True
        self.checked = 0
        self.request = 0

    def _spec(self):
        return spec(v_max=self.v_max, odometry_topic=self.odometry, a_max=self.a_max)

    # Users.

    @rule(who=st.sampled_from(PEOPLE))
    def take(self, who):
        before = self.bench.report().epoch
        epoch = self.bench.take(who)
        if epoch is not None and epoch != before:
            self._doubt()

    @rule(who=st.sampled_from(PEOPLE))
    def ask(self, who):
        self.bench.send(who, op="ask", robot="r1")

    @rule(who=st.sampled_from(PEOPLE), answer=st.sampled_from(["grant", "deny"]))
    def answer(self, who, answer):
        self.bench.send(who, op=answer, robot="r1")

    @rule(other=st.sampled_from(PEOPLE), speed=st.sampled_from([0.0, 0.3]))
    def takes_over(self, other, speed):
        """The usual change of control, perhaps of a robot that is still moving."""
        holder = self.bench.report().holder
        if holder is None or holder.connection == other:
            return
        self.ask(other)
        self.answer(holder.connection, "grant")
        if not self.bench.report().changing:
            return
        assert self._attempts()[-1].twist.is_zero
        seen = events.OdometryReceived(self.bench_key, Twist(speed))
        self.bench.run(0.6, lambda: self.bench.handle(seen) if self.odometry else None)
        self._doubt()
        if speed or not self.odometry:
            assert self.bench.report().holder is None, "no user controls a moving robot"

    @rule(who=st.sampled_from(PEOPLE), stops=st.booleans(), lets_go=st.booleans())
    def tests_the_stop(self, who, stops, lets_go):
        """A base that creeps, and then stops without a zero velocity, or does not."""
        if not self.odometry or not self.seeing:
            return
        bench = self.bench

        def each():
            last = bench.written[-1] if bench.written else None
            moves = last is not None and not (stops and bench.now - last.at > 0.2)
            twist = last.twist if moves else Twist()
            bench.handle(events.OdometryReceived(self.bench_key, twist))
            if not lets_go:
                self._command(who, 0.0)

        self.take(who)
        self._run(0.4, lambda: self._command(who, 0.0))
        bench.send(who, op="stop-test", robot="r1")
        self.creeping = bench.report().test is not None
        bench.run(1.0, each)

    @rule(who=st.sampled_from(PEOPLE))
    def release(self, who):
        self.bench.send(who, op="release", robot="r1")

    @rule(
        who=st.sampled_from(PEOPLE),
        x=st.sampled_from([0.0, 0.5, 1.0, -1.0, 3.0]),
        old_tick=st.sampled_from([0, 0, 0, 0, 3, 8]),
        old_epoch=st.sampled_from([0, 0, 0, 0, 1]),
        old_seq=st.sampled_from([0, 0, 0, 0, 1]),
    )
    def command(self, who, x, old_tick, old_epoch, old_seq):
        self._command(who, x, old_tick, old_epoch, old_seq)

    @rule(
        who=st.sampled_from(PEOPLE),
        x=st.sampled_from([0.0, 0.0, 0.5, 1.0, -1.0]),
        seconds=st.sampled_from([0.1, 0.3, 0.3, 0.6]),
    )
    def hold_keys(self, who, x, seconds):
        self._run(seconds, lambda: self._command(who, x))

    @rule(
        who=st.sampled_from(PEOPLE),
        x=st.sampled_from([0.5, 1.0, 3.0]),
        neutral=st.sampled_from([0.3, 0.3, 0.15]),
        then=st.sampled_from(
            ["tick", "epoch", "seq", "link", "bridge", "display", "hands", "leave"]
        ),
    )
    def drives_off(self, who, x, neutral, then):
        """A normal start, and then an event after which the robot must not move."""

        def press():
            self._command(who, x)

        self.take(who)
        self._run(neutral, lambda: self._command(who, 0.0))
        self._run(0.1, press)
        match then:
            case "tick" | "epoch" | "seq":
                self._run(0.03)
                old = {f"old_{then}": 8 if then == "tick" else 1}
                self._command(who, 0.7, **old)
            case "link":
                self.link_breaks()
                self.bench.connect_links()
            case "bridge":
                self.bridge_answers(False)
                self._run(0.4, press)
                self.bridge_answers(True)
            case "display":
                self.display_beats(False)
                self._run(0.4, press)
                self.display_beats(True)
            case "hands":
                self._run(0.25)
            case "leave":
                press()  # the velocity may still wait to be written
                self.page_is_reloaded(who)
                return
        self._run(0.3, press)

    def _command(self, who, x, old_tick=0, old_epoch=0, old_seq=0):
        bench, report = self.bench, self.bench.report()
        mine = report.holder is not None and report.holder.connection == who
        epoch = (report.epoch or 0) - old_epoch
        seq = bench.seq if old_seq else bench.seq + 1
        fresh = bench.gate._ticks.age(bench.tick - old_tick, bench.now)
        valid = (
            mine
            and not old_epoch
            and fresh is not None
            and fresh <= 0.3
            and seq > self.last_seq[who]
        )
        if valid:
            self.last_seq[who] = seq
        self.sent.append(Sent(bench.now, who, epoch, x == 0, valid))
        bench.drive(who, x=x, epoch=epoch, tick=bench.tick - old_tick, seq=seq)

    @rule(who=st.sampled_from(PEOPLE))
    def goal(self, who):
        before = len(self.bench.did(actions.SendGoal))
        holder = self.bench.report().holder
        self.bench.goal(who)
        if len(self.bench.did(actions.SendGoal)) > before:
            assert not self.stopped, "no goal starts while a STOP is active"
            assert holder is not None
            assert holder.connection == who, "only the holder sends goals"
            self.last_seq[who] = self.bench.seq
            self._doubt()

    @rule(who=st.sampled_from(PEOPLE), robot=st.sampled_from(["r1", "*"]))
    def stop(self, who, robot):
        at, before = self.bench.now, len(self._attempts())
        self.bench.send(who, op="stop", robot=robot)
        assert self.bench.report().holder is None
        self.stopped = True
        self._doubt()
        zeros = [w for w in self._attempts() if w.at == at and w.twist.is_zero]
        assert zeros, "STOP sends zero at once"
        assert len(self._attempts()) <= before + 1

    @rule()
    def looks_at_the_stop(self):
        self.seen = self.bench.stop_of()

    @rule(who=st.sampled_from(PEOPLE), late=st.booleans())
    def reset(self, who, late):
        """Reset the newest STOP, or (late) the STOP that a page saw earlier."""
        before, newest = len(self._attempts()), self.bench.stop_of()
        named = self.seen if late else newest
        self.bench.send(who, op="reset", robot="r1", stop=named)
        assert len(self._attempts()) == before, "a reset writes nothing"
        assert self.bench.report().holder is None or not self.stopped
        if named == newest:
            self.stopped = False

    @rule(by=st.sampled_from(["Ann", "Ben"]))
    def another_gate_receives_stop(self, by):
        """The other gate stores its STOP in the file that this gate also uses."""
        self.others += 1
        self.bench.disk[KEY] = Press(by, f"other-{self.others}")
        self.bench.handle(events.StopFileChanged(KEY, self.bench.disk[KEY]))
        self.stopped = True
        self._doubt()

    @rule()
    def gate_is_killed_and_started_anew(self):
        """Only the files on disk are left."""
        old = self.bench
        driven = [a.driven for a in old.did(actions.MarkDriven)]
        ticks, epochs = (
            Ticks(old.tick + 1000),
            Epochs(old.gate._machines._epochs.next()),
        )
        self.bench = PacedBench(
            now=old.now,
            beating=old.beating,
            answering=old.answering,
            clear=old.clear,
            was_driven=bool(driven and driven[-1]),
            disk=old.disk,
            gate=Gate(ticks, epochs),
        )
        self.checked, self.sent, self.silent_for = 0, [], 0.0
        self.parted, self.paced, self.moved_by, self.zero_since = 0, 0, None, True
        self.speeds = dict.fromkeys((*PEOPLE, PROGRAM), 9.0)
        self.last_seq = dict.fromkeys(PEOPLE, -1)
        self.bench.begin(self._spec())
        self._doubt()

    @rule(who=st.sampled_from(PEOPLE), v=st.sampled_from([0.2, 0.8, 9.0]))
    def speeds_of_page(self, who, v):
        self.bench.handle(protocol.Speeds(who, v, v))
        self.speeds[who] = v
        self.paced = len(self.bench.written)

    @rule(who=st.sampled_from(PEOPLE))
    def page_is_reloaded(self, who):
        self.bench.handle(protocol.Disconnect(who))
        self.bench.join(who)
        self.last_seq[who], self.speeds[who] = -1, 9.0

    @rule(who=st.sampled_from(PEOPLE), data=st.binary(max_size=30))
    def garbage(self, who, data):
        self.bench.handle(protocol.FromPage(who, data))

    # The program.

    @rule()
    def program_takes(self):
        self.request += 1
        self.bench.handle(protocol.FromProgram(commands.Take("r1"), self.request))

    @rule(vx=st.sampled_from([0.0, 0.4, 2.0]), old=st.sampled_from([0, 0, 8]))
    def program_twists(self, vx, old):
        bench, report = self.bench, self.bench.report()
        held = report.holder is not None and report.holder.connection == PROGRAM
        tick, epoch = bench.tick - old, report.epoch or 0
        age = bench.gate._ticks.age(tick, bench.now)
        valid = held and age is not None and age <= 0.3
        self.sent.append(Sent(bench.now, PROGRAM, epoch, vx == 0, valid))
        bench.handle(
            protocol.FromProgram(
                commands.SetVelocity("r1", epoch, tick, (vx, 0.0, 0.0))
            )
        )

    @rule(v_max=st.sampled_from([0.4, 1.0]))
    def declared_anew(self, v_max):
        self.v_max = v_max
        self.bench.handle(self._spec())

    @rule()
    def forgotten_and_declared(self):
        self.bench.handle(protocol.Forget("r1"))
        self.bench.handle(self._spec())

    # The world.

    def _run(self, seconds, each=None, step=STEP):
        sees = self.odometry is not None and self.seeing

        def fiftieth():
            if sees:
                self.bench.handle(events.OdometryReceived(self.bench_key, Twist()))
            if each is not None:
                each()

        self.bench.run(seconds, fiftieth if sees or each else None, step)
        if not self.bench.beating or not self.bench.answering:
            self._doubt_if_silent(seconds)

    @property
    def bench_key(self):
        return next(iter(self.bench.gate._machines._by_key))

    def _rest(self, seconds):
        """Let time pass without commands, with longer steps.

        The effects of earlier commands still end in steps of the usual length.
        """
        self._run(0.6)
        self._run(seconds - 1.3, step=0.05)
        self._run(0.7)

    def _doubt_if_silent(self, seconds):
        self.silent_for += seconds
        if self.silent_for > 0.32:
            self._doubt()

    silent_for = 0.0
    creeping = False
    """Whether there was a stop test, which creeps while every input is released."""
    epoch = 0
    """The newest epoch that was seen."""
    stopped = False
    """Whether a STOP was sent that has not been reset."""
    seen = "none"
    """The identity of the STOP that a page saw earlier."""
    others = 0
    """How many STOPs other gates received."""
    moved_by, zero_since = None, True
    """The epoch of the last motion, and whether a zero has followed."""
    parted = 0
    """How many writes were checked for that."""
    paced = 0
    """How many writes were made before the last change of a speed limit."""

    @rule(seconds=st.sampled_from([0.01, 0.05, 0.15, 0.25, 0.5]))
    def time_passes(self, seconds):
        self._run(seconds)

    @rule(seconds=st.sampled_from([0.1, 0.5, 3.0]))
    def gate_pauses(self, seconds):
        self.bench.now += seconds
        if seconds > 0.32:
            self._doubt()
        self._run(0.01)

    @rule()
    def everybody_rests(self):
        if self.bench.report().asker is not None:
            self._rest(10.0)  # the request is granted after this time
        self._rest(4.0)  # zeros on a new link go on for three seconds
        assert not self.bench.report().changing or not self.bench.up
        late = [w for w in self._attempts() if w.at > self.bench.now - 0.7]
        if self.stopped:
            assert all(w.twist.is_zero for w in late)
            assert len(late) >= 6 or not self.bench.up, "zeros while a STOP is active"
        else:
            assert late == [], "nothing is sent after the zeros"
        assert self.bench.gate.silent

    @rule()
    def link_breaks(self):
        self.bench.break_links()
        self._doubt()

    @precondition(lambda self: not self.bench.up)
    @rule()
    def link_comes_back(self):
        self.bench.connect_links()

    @rule(answering=st.booleans())
    def bridge_answers(self, answering):
        self.bench.answering = answering
        self.silent_for = 0.0

    @rule(beating=st.booleans())
    def display_beats(self, beating):
        self.bench.beating = beating
        self.silent_for = 0.0

    @rule(clear=st.booleans())
    def link_is_backed_up(self, clear):
        self.bench.clear = clear

    @rule(seeing=st.booleans())
    def odometry_comes(self, seeing):
        self.seeing = seeing

    # The promises.

    def _doubt(self):
        self.doubts.append(self.bench.now)

    def _attempts(self):
        return self.bench.attempts

    @invariant()
    def velocity_answers_an_accepted_command(self):
        for write in self.bench.written[self.checked :]:
            if write.twist.is_zero:
                continue
            cause = self._cause_of(write)
            assert cause is not None, "no command caused this velocity"
            assert write.twist.vy == 0
            limit = max(self.v_max, 0.0)
            assert abs(write.twist.vx) <= limit + 1e-9
            if write.by != PROGRAM:
                self._check_released(write, cause)
        self.checked = len(self.bench.written)

    def _mine(self, write, begin, end):
        """Return the accepted commands of the sender of a velocity in a period."""
        first = bisect_left(self.sent, begin, key=lambda s: s.at)
        last = bisect_right(self.sent, end, key=lambda s: s.at)
        return [
            s
            for s in self.sent[first:last]
            if s.valid and s.who == write.by and s.epoch == write.epoch
        ]

    def _cause_of(self, write):
        """Return the newest command that a velocity may answer."""
        for s in reversed(self._mine(write, write.at - 0.02 - LATE, write.at)):
            if not s.neutral or (self.creeping and write.twist.vx <= 0.1):
                return s
        return None

    def _check_released(self, write, cause):
        """Check that the inputs were released for 200 ms since the last doubt."""
        since = self.doubts[bisect_right(self.doubts, write.at) - 1]
        mine = self._mine(write, since, cause.at)
        run_start = last = None
        seen = False
        for s in mine:
            if last is not None and s.at >= last + 0.2 + 1e-6:
                run_start, seen = None, False
            if not s.neutral:
                run_start = None
            elif run_start is None:
                run_start = s.at
            elif s.at - run_start >= 0.2 - 1e-6:
                seen = True
            last = s.at
        assert seen, "no released inputs since the last doubt"

    @invariant()
    def epochs_only_grow(self):
        epoch = self.bench.report().epoch
        if epoch is not None:
            assert epoch >= self.epoch
            self.epoch = epoch

    @invariant()
    def a_stop_is_active_until_a_reset(self):
        assert self.bench.report().latched == self.stopped
        assert (KEY in self.bench.disk) == self.stopped
        if self.stopped:
            assert self.bench.report().holder is None
            assert all(w.twist.is_zero for w in self.bench.written[self.checked :])

    @invariant()
    def speed_is_within_what_the_page_asks_for(self):
        for write in self.bench.written[self.paced :]:
            if write.by is not None:
                assert abs(write.twist.vx) <= self.speeds[write.by] + 1e-9
        self.paced = len(self.bench.written)

    @invariant()
    def the_dead_man_holds(self):
        attempts = self._attempts()
        if not attempts or attempts[-1].twist.is_zero:
            return
        newest = next(s.at for s in reversed(self.sent) if s.valid)
        assert self.bench.now - newest <= DEADMAN + LATE or self._sends_zero(newest)

    def _sends_zero(self, since):
        """Run a step that is still due; return whether the gate then sends zero."""
        self.bench._do(self.bench.gate.step(self.bench.now))
        return self._attempts()[-1].twist.is_zero

    @invariant()
    def epochs_are_parted_by_zeros_and_only_grow(self):
        for write in self.bench.written[self.parted :]:
            if write.twist.is_zero:
                self.zero_since = True
                continue
            if self.moved_by is not None and write.epoch != self.moved_by:
                assert self.zero_since, "no zero between two epochs"
                assert write.epoch > self.moved_by, "an old epoch came back"
            self.moved_by, self.zero_since = write.epoch, False
        self.parted = len(self.bench.written)

    @invariant()
    def reports_can_be_believed(self):
        report = self.bench.report()
        assert (report.holder is None) == (report.epoch is None)
        assert report.v <= self.v_max
        if report.state == "driving":
            assert report.holder is not None
            assert self.bench_key.url == URL


TRIALS = int(os.environ.get("WEBMAP_SAFETY_TRIALS", "1"))
"""As for the tests of whole processes: 50 for the full run."""

SCHEDULES = 1000
"""Schedules of one test: Hypothesis keeps all of them in memory."""


@pytest.fixture
def note_done(request):
    """Return a function that notes that the test passed.

    If a run is resumed, skip a test that passed before. The notes are in a file beside
    the figures of whole processes.
    """
    name, figures = request.node.name, os.environ.get("WEBMAP_SAFETY_FIGURES")
    if not figures:
        return lambda: None
    path = Path(f"{figures}.schedules")
    resumed = os.environ.get("WEBMAP_SAFETY_RESUME") == "1" and path.exists()
    if resumed and name in path.read_text().split():
        pytest.skip("passed before the run was resumed")

    def note():
        with path.open("a") as file:
            file.write(f"{name}\n")

    return note


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("thousand", range(10 if TRIALS >= 20 else 1))
def test_no_sequence_of_events_breaks_a_safety_promise(note_done, thousand):
    run_state_machine_as_test(
        Motion,
        settings=settings(
            max_examples=SCHEDULES,
            stateful_step_count=50,
            deadline=None,
            print_blob=True,
        ),
    )
    note_done()

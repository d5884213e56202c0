"""Cause a fault while a robot is driven, and check the log of its velocities."""

import math
import time

import psutil
import pytest
from safety_bench import V_MAX, W_MAX, Bench, pass_time
from safety_figures import Figure, note
from safety_run import FULL, TRIALS, Progress, grace, is_measured
from safety_waiting import Waiting

from equipment.waiting import wait_for
from webmap.gate.rules.motion import LENGTH, NEW_LINK_LENGTH
from webmap.testing import Bounds, Quiet, check_invariants

EVERY = 5
"""In a full run, one of this number of trials is long; in a quick run, each one is.

The time until the robot stops does not depend on how long the fault lasts afterwards.
The behaviour after the end of the fault may depend on it, so the long trials let the
fault last, and watch the robot for a longer time.
"""

SHORT_WATCH = 0.3
"""Seconds for which the robot may not move after the fault in a short trial."""

BUSY = 0.02
"""Delay of the machine, in seconds, from which on the waits of the browser count too.

A browser that was just busy waits longer than the thread that measures the delay.
"""


class ProvingBench(Bench):
    """A bench that causes faults and measures the time until the robot stops."""

    short_trial = False
    """Whether this trial is short; see :data:`EVERY`."""

    loaded = False
    """Whether another program uses all free processor time.

    Then a quick run adds the waiting time of the threads to the promised time.
    """

    def stretch(self, long, short=0.3):
        """Return ``long`` seconds in a long trial, and ``short`` in a short trial."""
        return short if self.short_trial else long

    def linger(self, long, short=0.3):
        """Let the fault last: ``long`` seconds, or ``short`` in a short trial."""
        pass_time(self.stretch(long, short))

    def prove(
        self,
        name,
        fault,
        *,
        within,
        back=lambda: None,
        stops_by="zero",
        held_after=True,
        watch=0.5,
        few_late=0,
        before=lambda: None,
        new_link=False,
    ):
        """Cause a fault while the robot is driven, once in each trial.

        Args:
            name: The fault, as the table of figures names it.
            fault: Causes the fault.
            within: The promised time until the robot is stopped, in seconds.
            back: Ends the fault.
            stops_by: ``zero``: a zero must come; ``itself``: no process can send one,
                and the robot's own command timeout must stop it.
            held_after: Whether the key is still down when the fault ends.
            watch: Seconds for which the robot may not move after the fault ends.
            few_late: How many nonzero velocities may still arrive when the fault ends:
                a stalled link delivers the velocities that it has stored.
            before: Called while the robot moves, before the fault.
            new_link: Whether the gate may send the zeros on a new link, where it sends
                them for a longer time. This is so if no process can send a zero.

        """
        zeros = NEW_LINK_LENGTH if new_link or stops_by == "itself" else LENGTH
        if is_measured(name):
            pytest.skip("the resumed run already has this figure")
        begin, figures, progress = time.monotonic(), [], Progress(name, TRIALS)
        self.quiet, self.unreachable, self.causes = [], [], []
        for trial in range(TRIALS):
            self.short_trial = FULL and trial % EVERY != 0
            self._drive_before_fault(before)
            waiting = self.waiting()
            self.fault_at = time.monotonic()
            fault()
            figure = self._measure(within, stops_by)
            if (self.loaded or figure["jitter"] > BUSY) and not FULL:
                figure["jitter"] = max(figure["jitter"], waiting.seconds())
            watched = self.stretch(watch, SHORT_WATCH)
            self._recover(figure, back, held_after, watched, few_late)
            figures.append(figure)
            progress.add(figure["late"], figure["jitter"])
        pass_time(zeros + 0.2)
        log = [velocity for velocity in self.robot.log.twists if velocity.at >= begin]
        wrong = check_invariants(
            log,
            Bounds(
                V_MAX,
                W_MAX,
                zeros=zeros,
                late=few_late,
                slack=0.1 + self.sentinel.worst(begin),
            ),
            quiet=self.quiet,
            unreachable=self.unreachable,
            causes=self.causes,
        )
        assert not wrong, (name, wrong, figures)
        worst = max(figures, key=lambda figure: figure["late"] - figure["jitter"])
        note(
            Figure(
                name=name,
                stops_by=stops_by,
                promised=within,
                worst=max(figure["late"] for figure in figures),
                jitter=max(figure["jitter"] for figure in figures),
                trials=len(figures),
            )
        )
        for figure in figures:
            most = within + grace(figure["jitter"])
            assert figure["late"] <= most, (name, worst, figures)

    def _drive_before_fault(self, before):
        """Drive until the robot moves steadily, so that only the fault can stop it."""
        why = None
        for _ in range(5):
            try:
                self.drive_off()
            except (AssertionError, OSError, EOFError):
                # The page of the previous test may no longer work: use a new browser.
                self.end_browser()
                self.drive_off()
            try:
                before()
                if not self.robot.log.twists[-1].is_zero:
                    return
            except AssertionError as error:
                why = error
            self.let_go()
        raise AssertionError(
            "the robot stopped before the fault in five attempts"
        ) from why

    def waiting(self):
        """Measure from now on how long the processes from key to robot wait to run."""
        processes = [psutil.Process(), psutil.Process(self.display.popen.pid)]
        if self.gate:
            processes.append(self.gate)
        if self.browser:
            browser = psutil.Process(self.browser.process.pid)
            processes += [browser, *browser.children(recursive=True)]
        return Waiting(each.pid for each in processes)

    def _measure(self, within, stops_by):
        """Wait until the robot is stopped, and return how long this took."""
        stopped = self._stopped_after(self.fault_at, stops_by)
        # The dead-man timeout began with a command that may have been in transit.
        jitter = self.sentinel.stolen(self.fault_at - 0.1, stopped)
        if stops_by == "itself":
            # From the last message before the fault to the first message after it.
            self.unreachable.append((self.fault_at - 0.5, math.inf))
        return {"late": stopped - self.fault_at, "jitter": jitter, "within": within}

    def _recover(self, figure, back, held_after, watch, few_late):
        """End the fault with the key held down, and check that nothing resumes."""
        still = self.fault_at + figure["within"] + figure["jitter"] + 0.001
        recovering = time.monotonic()
        back()
        # While a part starts again, zeros may begin at any time.
        while recovering < time.monotonic():
            self.causes.append(recovering)
            recovering += 0.1
        if self.tab is not None and held_after:
            self.repeat_press()
        pass_time(watch)
        if self.unreachable and self.unreachable[-1][1] == math.inf:
            self.unreachable[-1] = (self.unreachable[-1][0], time.monotonic())
        late = self.robot.log.moving_since(still)
        if few_late and late:
            # TCP delivers the stored velocities; after them, only zeros may arrive.
            assert len(late) <= few_late, f"{len(late)} late velocities"
            still = late[-1].at
        self.quiet.append(Quiet(still, time.monotonic(), "after a fault, W still held"))
        if self.tab is not None:
            self.let_go()

    def _stopped_after(self, begun, stops_by):
        log = self.robot.log
        if stops_by == "zero":
            wait_for(lambda: log.first_zero(begun), "a zero")
            # A nonzero velocity in transit may arrive before the zero, not after it.
            return log.first_zero(begun)
        return wait_for(lambda: log.standstill(begun + 0.02), "a standstill")

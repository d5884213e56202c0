"""The proof: a fault is inflicted on a robot that is driven, and its log is judged."""

import math
import time

import psutil
import pytest
from safety_bench import V_MAX, W_MAX, Bench, pass_time, wait_for
from safety_figures import Figure, note
from safety_run import FULL, TRIALS, Progress, grace, is_measured
from safety_waiting import Waiting

from webmap.gate.rules.motion import LENGTH, NEW_LINK_LENGTH
from webmap.testing import Bounds, Quiet, check_invariants

EVERY = 5
"""Of how many trials of a full run one takes its time.

How soon the robot is stopped does not depend on how long a fault lasts after that; what
happens when it is mended might. So all trials measure the one, and a fifth of a full
run, as every trial of a quick one, waits for the other at length.
"""

HURRIED_WATCH = 0.3
"""Seconds for which nothing may move in the other trials."""


class ProvingBench(Bench):
    """A bench on which faults are inflicted and measured."""

    hurried = False
    """Whether this trial does not wait at length."""

    crowded = False
    """Whether a program beside takes all the processor that it can get.

    Then a quick run grants what a thread on the way waited for it.
    """

    def stretch(self, long, short=0.3):
        """Return how many seconds something lasts in this trial."""
        return short if self.hurried else long

    def linger(self, long, short=0.3):
        """Let the fault go on for a while, which is shorter in most trials."""
        pass_time(self.stretch(long, short))

    def prove(
        self,
        name,
        inflict,
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
        """Inflict a fault on a robot that is driven, as often as is asked for.

        Args:
            name: What fails, for the table.
            inflict: Makes it fail.
            within: Seconds in which the robot is promised to be stopped.
            back: Ends the fault.
            stops_by: ``zero``: a zero must come; ``itself``: no process can send one,
                and the robot's own timeout must stop it.
            held_after: Whether the key is still down when the fault ends.
            watch: Seconds for which nothing may move after the fault ends.
            few_late: How many moving velocities may still come when the fault ends, if
                the robot is driven through a link that keeps what it cannot pass on.
            before: Happens while the robot moves, before the fault.
            new_link: Whether the zeros may be owed on a new link, where they go on for
                longer; so they are if nobody can send one.

        """
        zeros = NEW_LINK_LENGTH if new_link or stops_by == "itself" else LENGTH
        if is_measured(name):
            pytest.skip("the run that is resumed has it")
        begin, figures, progress = time.monotonic(), [], Progress(name, TRIALS)
        self.quiet, self.unreachable, self.causes = [], [], []
        for trial in range(TRIALS):
            self.hurried = FULL and trial % EVERY != 0
            self._drive_before_fault(before)
            waiting = self.waiting()
            self.fault_at = time.monotonic()
            inflict()
            figure = self._measure(within, stops_by)
            if self.crowded and not FULL:
                figure["jitter"] = max(figure["jitter"], waiting.seconds())
            watched = self.stretch(watch, HURRIED_WATCH)
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
        """Drive, so that it is the fault that stops the robot and nothing else."""
        why = None
        for _ in range(5):
            try:
                self.drive_off()
            except (AssertionError, OSError, EOFError):
                # The test before may have left a page that is beyond repair.
                self.end_browser()
                self.drive_off()
            try:
                before()
                if not self.robot.log.twists[-1].is_zero:
                    return
            except AssertionError as error:
                why = error
            self.let_go()
        raise AssertionError("the robot stops again and again") from why

    def waiting(self):
        """Measure from now on how long the processes between key and robot wait."""
        processes = [psutil.Process(), psutil.Process(self.display.popen.pid)]
        if self.gate:
            processes.append(self.gate)
        if self.browser:
            browser = psutil.Process(self.browser.process.pid)
            processes += [browser, *browser.children(recursive=True)]
        return Waiting(each.pid for each in processes)

    def _measure(self, within, stops_by):
        """Wait until the robot is stopped, and return how long that took."""
        stopped = self._stopped_after(self.fault_at, stops_by)
        # The dead-man's time began with a command that may have been in transit.
        jitter = self.sentinel.stolen(self.fault_at - 0.1, stopped)
        if stops_by == "itself":
            # From the last message before the fault until the first one after it.
            self.unreachable.append((self.fault_at - 0.5, math.inf))
        return {"late": stopped - self.fault_at, "jitter": jitter, "within": within}

    def _recover(self, figure, back, held_after, watch, few_late):
        """End the fault with the key held down, and check that nothing resumes."""
        still = self.fault_at + figure["within"] + figure["jitter"] + 0.001
        recovering = time.monotonic()
        back()
        # While a part comes back, zeros may begin anew at any time.
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
            # TCP delivers what it had taken; then a zero must come, and nothing else.
            assert len(late) <= few_late, f"{len(late)} late velocities"
            still = late[-1].at
        self.quiet.append(Quiet(still, time.monotonic(), "after a fault, W held on"))
        if self.tab is not None:
            self.let_go()

    def _stopped_after(self, begun, stops_by):
        log = self.robot.log
        if stops_by == "zero":
            wait_for(lambda: log.first_zero(begun), "a zero")
            # A moving command that was on its way may come first, never after.
            return log.first_zero(begun)
        return wait_for(lambda: log.standstill(begun + 0.02), "standing still")

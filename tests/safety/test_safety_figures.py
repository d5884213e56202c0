"""The table that the documentation shows of a run."""

import json

from safety_figures import DOCS, Figure, table


def test_a_figure_is_a_line_in_milliseconds():
    figure = Figure("the page is frozen", "zero", 0.3, 0.0124, 0.0081, 50)
    line = table([figure]).splitlines()[-1]
    assert line == "| the page is frozen | a zero | 300 ms | 12 ms | 8 ms | 50 |"


def test_what_nobody_can_stop_is_told_from_what_gets_a_zero():
    figure = Figure("the gate is killed", "itself", 0.55, 0.51, 0.0, 1)
    assert "| its own timeout | 550 ms |" in table([figure])


def test_the_table_in_the_documentation_is_that_of_the_figures_beside_it():
    content = json.loads((DOCS / "safety-figures.json").read_text())
    figures = [Figure(**figure) for figure in content["figures"]]
    assert (DOCS / "safety-figures.md").read_text() == table(figures)

"""Percentiles and plots of the benchmark of a narrow uplink."""

import xml.etree.ElementTree as ET

from benchmarks.harness import percentile
from benchmarks.plot import Curve, Plot


def test_a_plot_has_a_line_for_each_curve_and_leaves_out_what_was_not_measured():
    curves = [
        Curve("a < b", [(0.0, 1.0), (5.0, float("nan")), (10.0, 40.0)]),
        Curve("c", [(0.0, 0.0)]),
    ]
    root = ET.fromstring(Plot("t", "x", "y", curves).svg())
    lines = root.findall("{http://www.w3.org/2000/svg}polyline")
    points = [each.attrib["points"].split() for each in lines]
    assert [len(each) for each in points] == [2, 1]
    # Both axes end at the largest values, so the last point is in the upper corner.
    assert points[0][1] == "624.0,36.0"
    assert "a < b" in "".join(root.itertext())


def test_percentiles_are_those_of_the_sorted_values():
    values = [float(number) for number in reversed(range(100))]
    assert percentile(values, 50) == 50.0
    assert percentile(values, 99) == 99.0
    assert percentile([], 50) != percentile([], 50)

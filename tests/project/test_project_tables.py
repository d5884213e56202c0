"""The tables of the documentation come from the results."""

from benchmarks.harness import Comparison, machine
from benchmarks.tables import tables


def result(title):
    comparison = Comparison(title, {"a": [{"cpu (us)": 1.0}], "b": [{"cpu (us)": 2.0}]})
    return {"machine": machine(), "comparisons": [comparison.as_dict()]}


def test_tables_are_in_the_order_of_the_benchmarks_with_their_machine():
    text = tables({"wire": result("of wire"), "bridge": result("of bridge")})
    assert text.index("### of bridge") < text.index("### of wire")
    assert "| cpu (us) | 1 | 2 (2.00 x, 2.00 to 2.00) |" in text
    assert text.count("Python 3.") == 2


def test_results_of_no_benchmark_are_left_out():
    assert tables({"soak": result("of soak")}) == "\n"

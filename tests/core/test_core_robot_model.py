"""What can be the model of a robot."""

import pytest

from webmap import Robot, svg
from webmap.errors import ConfigError


@pytest.mark.parametrize("model", ["circle", 5, lambda: None])
def test_what_is_no_element_is_no_model(model):
    with pytest.raises(ConfigError, match="robot 'Bob': a model is an element"):
        Robot("Bob", model)


def test_the_model_of_one_robot_is_not_taken_for_another():
    circle = svg.circle(r=0.2)
    ann = Robot("Ann", circle)
    with pytest.raises(ConfigError, match=r"'Bob': .* is that of the robot 'Ann'"):
        Robot("Bob", circle)
    assert circle in ann.svg.children
    ann.destroy()


def test_the_model_of_a_robot_that_is_gone_may_be_used_again():
    circle = svg.circle(r=0.2)
    Robot("Ann", circle).destroy()
    bob = Robot("Bob", circle)
    assert circle in bob.svg.children
    bob.destroy()

"""Valid models of a robot, and the image files in a model."""

import pytest

from webmap import Map, Robot, svg
from webmap.base.errors import ConfigError
from webmap.core.page import Page


@pytest.mark.parametrize("model", ["circle", 5, lambda: None])
def test_a_model_that_is_not_an_element_is_refused(model):
    with pytest.raises(ConfigError, match="robot 'Bob': a model is an element"):
        Robot("Bob", model)


def test_the_model_of_one_robot_cannot_be_used_for_another():
    circle = svg.circle(r=0.2)
    ann = Robot("Ann", circle)
    with pytest.raises(ConfigError, match=r"'Bob': .* is that of the robot 'Ann'"):
        Robot("Bob", circle)
    assert circle in ann.svg.children
    ann.destroy()


def test_the_model_of_a_destroyed_robot_can_be_used_again():
    circle = svg.circle(r=0.2)
    Robot("Ann", circle).destroy()
    bob = Robot("Bob", circle)
    assert circle in bob.svg.children
    bob.destroy()


# Image files are found beside the program and served while the model is shown.


@pytest.fixture
def picture(tmp_path):
    (tmp_path / "robot.png").write_bytes(b"png")
    return svg.image(href="robot.png", width=1, height=1)


@pytest.fixture
def other_page(page, channel, publisher):
    """A page of another viewer."""
    return Page(page.entry, type(channel)(), page.viewer, publisher, {})


def shown(page, robot):
    map = Map(page.element("webmap_container"), 700, 500)
    map.add_robot(robot)
    return map


def test_an_image_of_a_model_is_published_from_the_folder_of_the_page(page, picture):
    bob = Robot("Bob", svg.g(picture))
    assert picture.get("href") == "robot.png"
    shown(page, bob)
    assert picture.get("href") == "/_webmap/images/robot.png"
    bob.destroy()


def test_the_image_of_a_shared_robot_is_published_until_its_last_page_is_closed(
    page, other_page, picture, publisher
):
    bob = Robot("Bob", picture)
    shown(page, bob)
    shown(other_page, bob)
    page.close()
    assert publisher.images == ["robot.png"]
    assert picture.get("href") == "/_webmap/images/robot.png"
    other_page.close()
    assert publisher.images == []
    assert picture.get("href") == "robot.png"
    bob.destroy()


def test_an_image_added_to_a_model_later_is_published_for_the_next_page(
    page, other_page, picture, publisher
):
    bob = Robot("Bob", svg.g())
    shown(page, bob)
    bob.model.append(picture)
    shown(other_page, bob)
    assert picture.get("href") == "/_webmap/images/robot.png"
    bob.destroy()


@pytest.mark.parametrize(
    "href", ["/static/robot.png", "nowhere.png", "../robot.png", "#part"]
)
def test_an_href_that_is_not_a_file_of_the_folder_is_not_changed(page, publisher, href):
    image = svg.image(href=href)
    bob = Robot("Bob", image)
    shown(page, bob)
    assert image.get("href") == href
    assert publisher.images == []
    bob.destroy()


def test_an_href_set_by_a_program_is_kept_when_the_page_is_closed(page, picture):
    bob = Robot("Bob", picture)
    shown(page, bob)
    picture.set(href="/static/other.png")
    page.close()
    assert picture.get("href") == "/static/other.png"
    bob.destroy()


def test_plain_data_contain_the_file_name_while_a_page_shows_the_image(page, picture):
    bob = Robot("Bob", svg.g(picture))
    before = bob.to_dict()
    shown(page, bob)
    assert bob.to_dict() == before
    assert before["model"]["children"][0]["attributes"]["href"] == "robot.png"
    bob.destroy()

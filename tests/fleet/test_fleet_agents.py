"""Fleet files with robots of agents, which the agents describe themselves."""

import pytest

from webmap.base.errors import ConfigError
from webmap.fleet.made import prepare

AGENTS = '[bridges]\nyard = "zenoh://hall:7447"\n'


def written(folder, text):
    file = folder / "fleet.toml"
    file.write_text(text)
    return file


def test_a_file_with_agents_needs_no_robots(tmp_path):
    ready = prepare(written(tmp_path, AGENTS))
    assert (ready.agents, ready.bridges, ready.robots) == (["zenoh://hall"], {}, [])


def test_robots_without_a_bridge_are_behind_the_only_rosbridge(tmp_path):
    text = f'{AGENTS}hall = "ws://hall:9090"\n[[robots]]\nname = "Bob"\n'
    ready = prepare(written(tmp_path, f'{text}odometry = "/odom"\n'))
    (robot,) = ready.robots
    assert robot.feed.bridge is ready.bridges["hall"]
    robot.destroy()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            f'{AGENTS}[[robots]]\nname = "Bob"\nbridge = "yard"\nodometry = "/odom"',
            "yard is for agents, whose own fleet files have their robots",
        ),
        (
            '[bridges]\nyard = {url = "zenoh://hall", alignment = [1.0, 2.0, 0.0]}',
            "the fleet file of each agent has the alignment of its robots",
        ),
        ('[bridges]\nhall = "ws://hall:9090"', "robots: got nothing"),
    ],
)
def test_what_an_agent_describes_itself_is_refused(tmp_path, text, words):
    with pytest.raises(ConfigError, match=words):
        prepare(written(tmp_path, text))

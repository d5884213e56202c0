"""Modules: any object, by name; a failing module does not affect others."""

import asyncio

import pytest

from equipment.waiting import until
from webmap import Extendable, Map, Namespace, Robot
from webmap.base.errors import ConfigError, ModuleNotFound
from webmap.base.scope import Removal, current_scope, keep
from webmap.core.registry import _built_in_files, map_modules, robot_modules


@pytest.fixture
def namespace() -> Namespace:
    return Namespace("test")


def test_a_module_is_constructed_with_its_owner_and_the_arguments(namespace):
    @namespace.register
    class Horn:
        def __init__(self, owner, tone, *, loud=False) -> None:
            self.made_with = (owner, tone, loud)

    owner = Extendable(namespace)
    module = owner.add_module("Horn", 440, loud=True)
    assert module.made_with == (owner, 440, True)
    assert owner.modules == [module]


def test_an_unknown_module_name_is_refused_with_the_known_and_the_nearest_name(
    namespace,
):
    namespace.register(dict, name="Horn")
    namespace.register(list, name="Lamp")
    with pytest.raises(ModuleNotFound, match=r"'Hron'.*mean 'Horn'.*Horn, Lamp"):
        Extendable(namespace).add_module("Hron")


def test_the_built_in_modules_are_found_by_name():
    import webmap

    assert {"MouseViewControl", "MapViewControl", "ShowSelected", "Teleop"} <= set(
        webmap.modules.map.namespace.names()
    )
    assert "LaserScanner" in dir(webmap.modules.robot)
    view_control = webmap.modules.map.MouseViewControl
    assert view_control is webmap.modules.map.MapViewControl


def test_each_built_in_module_is_found_by_its_name_alone():
    for namespace in (map_modules, robot_modules):
        for name in namespace.names():
            module = namespace[name].__module__
            if module.startswith("webmap."):
                assert _built_in_files().get(name) == module, f"add {name} to FILES"


def test_a_module_name_can_be_registered_only_once(namespace):
    namespace.register(dict, name="Horn")
    with pytest.raises(ValueError, match="already registered as builtins"):
        namespace.register(list, name="Horn")


def test_removing_a_module_destroys_the_module_and_removes_its_listeners(namespace):
    gone = []

    class Tidy:
        def __init__(self, owner) -> None:
            keep(Removal(lambda: gone.append("listener")))

        def destroy(self):
            gone.append("destroyed")

    owner = Extendable(namespace)
    module = owner.add_module(Tidy)
    owner.remove_module(module)
    assert gone == ["destroyed", "listener"]
    with pytest.raises(ValueError, match="not a module"):
        owner.remove_module(module)


def test_a_module_whose_constructor_raises_leaves_nothing_behind(namespace):
    gone = []

    def broken(owner):
        keep(Removal(lambda: gone.append("listener")))
        raise RuntimeError("no")

    owner = Extendable(namespace)
    with pytest.raises(RuntimeError):
        owner.add_module(broken)
    assert owner.modules == []
    assert gone == ["listener"]


def test_an_exception_in_one_module_does_not_affect_other_modules(namespace):
    seen, reported = [], []

    class Bad:
        def __init__(self, owner) -> None:
            pass

        def on_ring(self, n):
            raise RuntimeError("flat battery")

    class Good(Bad):
        def on_ring(self, n):
            seen.append(n)

    class Owner(Extendable):
        def report_error(self, text):
            reported.append(text)

    owner = Owner(namespace)
    owner.add_module(Bad)
    owner.add_module(Good)
    owner.notify_modules("on_ring", 3)
    owner.notify_modules("on_silence")
    assert seen == [3]
    assert reported == ["Bad.on_ring failed: RuntimeError: flat battery"]


class Reporting(Extendable):
    def __init__(self, namespace):
        super().__init__(namespace)
        self.reported = []

    def report_error(self, text):
        self.reported.append(text)


class Slow:
    """A module whose trigger waits."""

    def __init__(self, owner) -> None:
        self.go, self.received = asyncio.Event(), []

    async def on_ring(self, n):
        await self.go.wait()
        self.received.append((n, 10 // n, current_scope()))


def test_coroutine_triggers_of_several_modules_run_concurrently(namespace):
    async def scenario():
        owner = Reporting(namespace)
        slow, slower = owner.add_module(Slow), owner.add_module(Slow)
        owner.notify_modules("on_ring", 5)
        for module in (slower, slow):
            module.go.set()
            await asyncio.wait_for(seen(module), 10)
        assert [received[:2] for received in slow.received + slower.received] == [
            (5, 2),
            (5, 2),
        ]
        assert slow.received[0][2] is not slower.received[0][2], "each in its own scope"
        assert owner.reported == []

    async def seen(module):
        while not module.received:
            await asyncio.sleep(0)

    asyncio.run(scenario())


def test_a_waiting_coroutine_trigger_is_cancelled_with_its_module(namespace):
    async def scenario():
        owner = Reporting(namespace)
        slow = owner.add_module(Slow)
        owner.notify_modules("on_ring", 5)
        await asyncio.sleep(0)
        owner.remove_module(slow)
        slow.go.set()
        while len(asyncio.all_tasks()) > 1:
            await asyncio.sleep(0)
        assert slow.received == owner.reported == []

    asyncio.run(scenario())


def test_a_coroutine_trigger_that_removes_its_own_module_runs_to_its_end(namespace):
    class Once:
        def __init__(self, owner):
            self.owner, self.done = owner, False

        async def on_ring(self):
            self.owner.remove_module(self)
            await asyncio.sleep(0)
            self.done = True

    async def scenario():
        owner = Reporting(namespace)
        once = owner.add_module(Once)
        owner.notify_modules("on_ring")
        while len(asyncio.all_tasks()) > 1:
            await asyncio.sleep(0)
        assert once.done

    asyncio.run(scenario())


def test_removing_a_module_before_its_coroutine_trigger_starts_is_no_error(namespace):
    async def scenario():
        owner = Reporting(namespace)
        slow = owner.add_module(Slow)
        owner.notify_modules("on_ring", 5)
        owner.remove_module(slow)
        while len(asyncio.all_tasks()) > 1:
            await asyncio.sleep(0)
        assert owner.reported == []

    asyncio.run(scenario())


def test_a_module_cannot_be_added_to_a_destroyed_robot_or_map(container):
    made = []
    for owner in (Robot("Bob"), Map(container, 100, 100)):
        owner.destroy()
        with pytest.raises(ConfigError, match="was destroyed, so no module can be"):
            owner.add_module(made.append)
    assert made == []


def test_an_exception_in_a_coroutine_trigger_is_reported(namespace):
    async def scenario():
        owner = Reporting(namespace)
        owner.add_module(Slow).go.set()
        owner.notify_modules("on_ring", 0)
        (message,) = await until(lambda: owner.reported)
        assert message.startswith("Slow.on_ring failed: ZeroDivisionError: ")

    asyncio.run(scenario())


def test_a_coroutine_trigger_without_an_event_loop_is_reported(namespace):
    owner = Reporting(namespace)
    owner.add_module(Slow)
    owner.notify_modules("on_ring", 1)
    assert owner.reported == [
        "Slow.on_ring failed: RuntimeError: it is a coroutine, which only WebMap runs: "
        "after webmap.start(), and in the model's thread"
    ]


def test_a_problem_of_a_module_is_a_problem_of_its_robot_until_mended(namespace):
    class Sensor:
        def __init__(self, robot) -> None:
            self.scope = current_scope()

    robot = Robot("Bob")
    scope = robot.add_module(Sensor).scope
    scope.report("/scan: a callback raised", None)
    assert not robot.problems
    scope.report("/scan: expected a scan, got a map", "scan")
    scope.report("/map: expected a map, got a scan", "map")
    assert list(robot.problems.values()) == [
        "/scan: expected a scan, got a map",
        "/map: expected a map, got a scan",
    ]
    scope.mended("scan")
    assert list(robot.problems.values()) == ["/map: expected a map, got a scan"]
    scope.mended("map")
    assert not robot.problems


def test_a_module_can_fire_its_own_triggers():
    seen = []

    class Bumper:
        def __init__(self, robot) -> None:
            self.robot = robot

        def hit(self):
            self.robot.notify_modules("on_bump", "left")

    class Listener:
        def __init__(self, robot) -> None:
            pass

        def on_bump(self, side):
            seen.append(side)

    robot = Robot("Bob")
    robot.add_module(Listener)
    robot.add_module(Bumper).hit()
    assert seen == ["left"]


def test_a_subclass_can_have_its_own_namespace(namespace):
    namespace.register(lambda owner: "a wheel", name="Wheel")

    class Cart(Robot):
        def __init__(self, name) -> None:
            super().__init__(name, namespace=namespace)

    assert Cart("cart").add_module("Wheel") == "a wheel"

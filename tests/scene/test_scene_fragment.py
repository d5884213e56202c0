from hypothesis import given
from hypothesis import strategies as st

from webmap.scene import html, svg
from webmap.scene.node import Added, Changed, Fragment, Removed, Text


def test_there_are_no_changes_since_the_current_revision():
    fragment = Fragment(svg.g())
    assert fragment.changes_since(fragment.revision) == []


def test_only_the_newest_value_of_each_attribute_is_a_change():
    root = svg.g()
    fragment = Fragment(root)
    for x in range(100):
        root.set_pose(x, 0, 0)
        root.set(fill="red" if x % 2 else "blue")
    changes = fragment.changes_since(0)
    assert sorted(changes, key=lambda c: c.slot) == [
        Changed(root, "fill"),
        Changed(root, "transform"),
    ]


def test_an_equal_value_is_no_change():
    root = svg.path(fill="red", class_="dot")
    fragment = Fragment(root)
    root.set_pose(1, 2, 3)
    root.set_dots(b"1234", 1)
    before = fragment.revision
    root.set_pose(1, 2, 3)
    root.set_dots(b"1234", 1)
    root.set(fill="red", class_="dot")
    root.classes.add("dot")
    assert fragment.revision == before


def test_setting_checked_to_the_same_value_is_a_change():
    box = html.input(type="checkbox", checked=True)
    fragment = Fragment(box)
    box.set(checked=True)
    assert fragment.changes_since(0) == [Changed(box, "checked")]


def test_a_new_element_is_added_as_a_whole():
    root = svg.g(svg.rect())
    fragment = Fragment(root)
    since = fragment.revision
    child = svg.g(svg.circle())
    root.append(child)
    child.children[0].set(r=2)
    child.append(svg.line())
    assert fragment.changes_since(since) == [Added(child, root.children[0])]


def test_new_siblings_are_added_from_left_to_right():
    old = svg.g()
    root = svg.g(old)
    fragment = Fragment(root)
    a, b, c = svg.g(), svg.g(), svg.g()
    root.append(c).insert(0, b).insert(0, a)
    assert fragment.changes_since(0) == [Added(a, None), Added(b, a), Added(c, old)]


def test_an_element_removed_before_sending_causes_no_change():
    root = svg.g()
    fragment = Fragment(root)
    for _ in range(10_000):
        child = svg.g()
        root.append(child)
        child.set_pose(1, 2, 3)
        child.remove()
    assert fragment.changes_since(0) == []
    assert not fragment._removed
    assert not fragment._touched
    assert not fragment._added


def test_the_removal_log_is_limited_and_reports_missing_entries():
    root = svg.g()
    fragment = Fragment(root)
    start = fragment.revision
    for _ in range(Fragment.REMOVALS_KEPT + 1):
        child = svg.g()
        root.append(child)
        fragment.mark_sent()
        child.remove()
    assert len(fragment._removed) == Fragment.REMOVALS_KEPT
    assert fragment.changes_since(start) is None
    assert fragment.changes_since(fragment.revision) == []


def test_a_moved_element_is_removed_and_added_again():
    child = svg.g()
    left, right = svg.g(child), svg.g()
    fragment = Fragment(svg.g(left, right))
    fragment.mark_sent()
    right.append(child)
    assert fragment.changes_since(0) == [Removed(child.id), Added(child, None)]


def test_nodes_are_found_by_id_only_while_they_are_in_the_fragment():
    child = svg.g("text")
    root = svg.g(child)
    fragment = Fragment(root)
    assert fragment.find(child.children[0].id) is child.children[0]
    child.remove()
    assert fragment.find(child.id) is None
    assert child.fragment is None
    assert len(fragment) == 1


def test_adding_or_removing_an_event_handler_is_a_change():
    root = svg.g()
    fragment = Fragment(root)
    removal = root.on("click", print)
    assert fragment.changes_since(0) == [Changed(root, "events")]
    since = fragment.revision
    removal.remove()
    assert fragment.changes_since(since) == [Changed(root, "events")]


class Mirror:
    """Applies changes as a viewer does, without encoding."""

    def __init__(self, fragment):
        self.fragment = fragment
        self.revision = fragment.revision
        fragment.mark_sent()
        self.children = {}
        self.data = {}
        self.create(fragment.root)

    def create(self, node):
        assert node.id not in self.data
        self.data[node.id] = node.data if isinstance(node, Text) else node.get("fill")
        self.children[node.id] = []
        for child in getattr(node, "children", ()):
            self.create(child)
            self.children[node.id].append(child.id)

    def forget(self, node_id):
        for child in self.children.pop(node_id):
            self.forget(child)
        del self.data[node_id]

    def follow(self):
        for change in self.fragment.changes_since(self.revision):
            match change:
                case Removed(node_id):
                    if node_id in self.data:
                        for siblings in self.children.values():
                            if node_id in siblings:
                                siblings.remove(node_id)
                        self.forget(node_id)
                case Added(node, after):
                    self.create(node)
                    siblings = self.children[node.parent.id]
                    siblings.insert(
                        siblings.index(after.id) + 1 if after else 0, node.id
                    )
                case Changed(node, "fill"):
                    self.data[node.id] = node.get("fill")
                case Changed(node, "text"):
                    self.data[node.id] = node.data
        self.revision = self.fragment.revision

    def check(self):
        fresh = Mirror(self.fragment)
        assert (self.children, self.data) == (fresh.children, fresh.data)


steps = st.lists(
    st.tuples(
        st.sampled_from(
            ["add", "move", "remove", "fill", "text", "follow 0", "follow 1"]
        ),
        st.integers(0, 30),
        st.integers(0, 30),
        st.integers(0, 30),
    ),
    max_size=60,
)


@given(steps)
def test_viewers_that_update_at_different_times_see_the_same_tree(steps):
    fragment = Fragment(svg.g())
    mirrors = [Mirror(fragment), Mirror(fragment)]
    for step, a, b, c in steps:
        groups = [n for n in fragment.root.walk() if not isinstance(n, Text)]
        one, other = groups[a % len(groups)], groups[b % len(groups)]
        place = c % (len(one.children) + 1)
        match step:
            case "add":
                one.insert(place, svg.g(svg.g("x")))
            case "move":
                if one not in list(other.walk()):
                    one.insert(place, other)
            case "remove":
                if one is not fragment.root:
                    one.remove()
            case "fill":
                one.set(fill=str(b))
            case "text":
                one.text = str(b)
            case follow:
                mirrors[int(follow[-1])].follow()
    for mirror in mirrors:
        mirror.follow()
        mirror.check()

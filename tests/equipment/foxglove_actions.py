"""A navigation behind the server of foxglove_bridge 3, with its hidden services.

rosbags makes and reads the messages, so that the gate reads bytes that it has not
written. The tests decide what the navigation answers.
"""

import threading

import foxglove
import numpy as np
from foxglove.websocket import Capability
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
GOAL = "unique_identifier_msgs/UUID goal_id\n"
RESULTS = {
    "humble": "std_msgs/Empty result",
    "jazzy": "uint16 error_code",
    "kilted": "uint16 error_code\nstring error_msg",
}
"""The result of NavigateToPose in versions of ROS."""

FEEDBACK = """geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining
"""
ACTION = "nav2_msgs/action/NavigateToPose"
DEFINITIONS = {
    "SendGoal_Request": f"{GOAL}geometry_msgs/PoseStamped pose\nstring behavior_tree",
    "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
    "GetResult_Request": GOAL,
    "FeedbackMessage": GOAL + FEEDBACK,
    "CancelGoal_Request": "action_msgs/GoalInfo goal_info",
    "CancelGoal_Response": "int8 return_code\naction_msgs/GoalInfo[] goals_canceling",
    **{
        f"GetResult_Response_{version}": f"int8 status\n{fields}"
        for version, fields in RESULTS.items()
    },
}
for name, text in DEFINITIONS.items():
    STORE.register(get_types_from_msg(text, f"nav2_msgs/msg/{name}"))

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Statuses of a goal that has ended."""


def write(name, **fields):
    """Return a message in CDR; fields that are left out are zero or empty."""
    type = f"nav2_msgs/msg/{name}"
    return bytes(STORE.serialize_cdr(_made(type, fields), type))


def _made(type, given):
    values = {}
    for name, (kind, about) in STORE.get_msgdef(type).fields:
        if kind == 2:  # a type in it
            values[name] = _made(about, given.get(name, {}))
        elif kind == 3:
            values[name] = np.array(given.get(name, [0] * about[1]), dtype=np.uint8)
        elif kind == 4:
            values[name] = given.get(name, [])
        else:
            values[name] = given.get(name, "" if about[0] == "string" else 0)
    return STORE.types[type](**values)


class Goal:
    """A goal that the navigation has accepted."""

    def __init__(self, request):
        self.id = bytes(request.goal_id.uuid)
        self.request = request
        self.result = None
        """The status and the fields of the result, once the goal has ended."""
        self.ended = threading.Event()

    def end(self, status, **fields):
        """End the goal; without a status the service fails."""
        if self.result is None:
            self.result = (status, fields)
            self.ended.set()


class Navigation:
    """The action server of NavigateToPose; used as a context manager."""

    def __init__(self, action="/navigate_to_pose", *, version="kilted", port=0):
        self.action, self.version = action, version
        self.goals = []
        self.rejects = self.breaks = False
        self.cancels = 0
        self._context = foxglove.Context()
        self._server = foxglove.start_server(
            port=port,
            context=self._context,
            capabilities=[Capability.ClientPublish, Capability.Services],
            supported_encodings=["cdr"],
        )
        self.url = f"foxglove://127.0.0.1:{self._server.port}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for goal in self.goals:
            goal.end(None)
        self._server.stop()

    def offer(self, *parts):
        """Offer the action, as a bridge with ``include_hidden`` does."""
        handlers = {
            "send_goal": (f"{ACTION}_SendGoal", self._send_goal),
            "get_result": (f"{ACTION}_GetResult", self._get_result),
            "cancel_goal": ("action_msgs/srv/CancelGoal", self._cancel_goal),
        }
        self._feedback = foxglove.Channel(
            f"{self.action}/_action/feedback",
            message_encoding="cdr",
            schema=foxglove.Schema(
                name=f"{ACTION}_FeedbackMessage",
                encoding="ros2msg",
                data=STORE.generate_msgdef("nav2_msgs/msg/FeedbackMessage")[0].encode(),
            ),
            context=self._context,
        )
        self._server.add_services(
            [
                foxglove.Service(
                    f"{self.action}/_action/{part}",
                    schema=foxglove.ServiceSchema(type),
                    handler=handler,
                )
                for part, (type, handler) in handlers.items()
                if part in (parts or handlers)
            ]
        )

    def withdraw(self):
        """Offer the action no longer, as after the end of its node."""
        parts = ("send_goal", "get_result", "cancel_goal")
        names = [f"{self.action}/_action/{part}" for part in parts]
        self._server.remove_services(names)
        self._feedback.close()

    def feedback(self, left, id=None):
        """Send the feedback of the newest goal, or of any identifier."""
        message = write(
            "FeedbackMessage",
            goal_id={"uuid": list(self.goals[-1].id if id is None else id)},
            current_pose={"header": {"frame_id": "map"}},
            navigation_time={"sec": 3, "nanosec": 500_000_000},
            estimated_time_remaining={"sec": 4},
            number_of_recoveries=2,
            distance_remaining=left,
        )
        self._feedback.log(message)

    def _send_goal(self, request):
        if self.breaks:
            raise RuntimeError("out of order")
        type = "nav2_msgs/msg/SendGoal_Request"
        if not self.rejects:
            self.goals.append(Goal(STORE.deserialize_cdr(request.payload, type)))
        return write("SendGoal_Response", accepted=not self.rejects)

    def _get_result(self, request):
        type = "nav2_msgs/msg/GetResult_Request"
        id = bytes(STORE.deserialize_cdr(request.payload, type).goal_id.uuid)
        goal = next(goal for goal in self.goals if goal.id == id)
        goal.ended.wait()
        status, fields = goal.result
        if status is None:
            raise RuntimeError("the action server has died")
        return write(f"GetResult_Response_{self.version}", status=status, **fields)

    def _cancel_goal(self, request):
        self.cancels += 1
        for goal in self.goals:
            goal.end(CANCELED)
        return write("CancelGoal_Response")

"""What fingertip.ros2_gripper needs of rclpy and control_msgs, where there is no ROS: install() puts it in their place.

It refuses what the true ones refuse: transitions that a goal does not allow, fields of another type, feedback of another action. One thread.
"""

import enum
import sys
import types

from fingertip import host_time


def message(**kinds):
    """kinds: the type of each field, or [of its elements]."""

    class Message:
        __slots__ = tuple(kinds)

        def __init__(self):
            for name, kind in kinds.items():
                setattr(self, name, [] if isinstance(kind, list) else kind())

        def __setattr__(self, name, value):
            kind = kinds.get(name, object)
            assert all(isinstance(each, kind[0]) for each in value) if isinstance(kind, list) else isinstance(value, kind), name
            super().__setattr__(name, value)

    return Message


Time = message(sec=int, nanosec=int)
JointState = message(header=message(stamp=Time, frame_id=str), name=[str], position=[float], velocity=[float], effort=[float])
STATE = {"position": float, "effort": float, "stalled": bool, "reached_goal": bool}
COMMAND = message(position=float, max_effort=float)
GripperCommand = types.SimpleNamespace(Goal=message(command=COMMAND), Result=message(**STATE), Feedback=message(**STATE))
ENDED = message(state=JointState, stalled=bool, reached_goal=bool)
ParallelGripperCommand = types.SimpleNamespace(Goal=message(command=JointState), Result=ENDED, Feedback=message(state=JointState))
GoalResponse = enum.Enum("GoalResponse", "REJECT ACCEPT")
CancelResponse = enum.Enum("CancelResponse", "REJECT ACCEPT")
# By rcl_action's state machine.
TRANSITIONS = {
    "accepted": {"execute": "executing", "cancel": "canceling"},
    "executing": {"cancel": "canceling", "succeed": "succeeded", "abort": "aborted"},
    "canceling": {"succeed": "succeeded", "abort": "aborted", "canceled": "canceled"},
}


class Future:
    def __init__(self, *, executor=None):
        self.results = []

    def __await__(self):
        while not self.results:
            yield
        return self.results[0]

    def set_result(self, result):
        self.results.append(result)


class GoalHandle:
    def __init__(self, server):
        self.status, self.result, self.feedback, self._server = "accepted", None, [], server
        for event in ("succeed", "abort", "canceled"):
            setattr(self, event, lambda event=event: self.update(event))

    is_cancel_requested = property(lambda self: self.status == "canceling")

    def update(self, event):
        self.status = TRANSITIONS.get(self.status, {})[event]  # KeyError: the state does not allow it

    def execute(self, execute_callback=None):
        self.update("execute")
        self._server.node.tasks.append(self._run(execute_callback))

    async def _run(self, execute_callback):
        result = await execute_callback(self)
        assert self.status not in TRANSITIONS and isinstance(result, self._server.action.Result), self.status
        self.result = result

    def publish_feedback(self, feedback):
        assert isinstance(feedback, self._server.action.Feedback)
        self.feedback.append(feedback)


class ActionServer:
    def __init__(self, node, action_type, action_name, execute_callback, *, goal_callback, handle_accepted_callback, cancel_callback):
        self.node, self.action = node, action_type
        self._asks, self._begins, self._ends = goal_callback, handle_accepted_callback, cancel_callback
        node.servers[action_name] = self

    def send(self, goal):
        """None: it was rejected."""
        if self._asks(goal) is GoalResponse.ACCEPT:
            handle = GoalHandle(self)
            self._begins(handle)
            return handle

    def cancel(self, handle):
        if handle.status in TRANSITIONS and self._ends(handle) is CancelResponse.ACCEPT:
            handle.update("cancel")


class Node:
    executor = None

    def __init__(self):
        self.servers, self.timers, self.tasks, self.said = {}, [], [], []

    def create_timer(self, timer_period_sec, callback):
        self.timers.append(callback)

    def get_logger(self):
        return types.SimpleNamespace(info=self.said.append, error=self.said.append)

    def get_clock(self):
        return types.SimpleNamespace(now=lambda: types.SimpleNamespace(to_msg=Time))

    def end(self, handle):
        """Spins until the goal has ended: its status, its result."""
        while handle.result is None:
            for task in self.tasks[:]:
                try:
                    task.send(None)
                except StopIteration:
                    self.tasks.remove(task)
            for callback in self.timers:
                callback()
            host_time.sleep(0.05)
        return handle.status, handle.result


def install():
    for name, names in (
        ("rclpy.action", {"ActionServer": ActionServer, "GoalResponse": GoalResponse, "CancelResponse": CancelResponse}),
        ("rclpy.task", {"Future": Future}),
        ("control_msgs.action", {"GripperCommand": GripperCommand, "ParallelGripperCommand": ParallelGripperCommand}),
    ):
        sys.modules[name.split(".")[0]] = sys.modules[name] = types.SimpleNamespace(**names)

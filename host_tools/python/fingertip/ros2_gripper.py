"""Actions of ROS 2 for a running `fingertip grasp`: control_msgs/action/GripperCommand, and ParallelGripperCommand where control_msgs has it.

    fingertip-ros2-gripper [--ros-args -p left:=SERIAL -r __node:=left_hand]

host_tools/README.md, "In ROS 2 and LeRobot", has the fields and their units. Needs rclpy and control_msgs.
"""

import argparse
import contextlib
import functools
import importlib
import math
from typing import Any

from .errors import FingertipError, InputError
from .running_grasp import RunningGrasp

NODE = "fingertip_grasp"
POLL_s = 0.05
REACHED_mm = 1.0
APPROACH_MOST_mm_s = 8.0
_CLOSES = ("activating", "approach", "squeeze", "ready")
_HELD = ("holding", "slipping")


def _ros(module: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(f"{error}: needs rclpy and control_msgs; source the setup.bash of ROS 2") from None


def _wanted(command: Any) -> tuple[float, float, float]:
    """mm, N and mm/s; 0 where it is not given. Raises FingertipError."""
    position, effort, velocity = command.position, getattr(command, "max_effort", 0.0), 0.0
    if hasattr(command, "name"):  # of a ParallelGripperCommand
        if len(command.position) != 1:
            raise FingertipError(f"{len(command.position)} positions; give one, the gap in m")
        position, effort, velocity = position[0], sum(command.effort[:1]), sum(command.velocity[:1])
    if not (math.isfinite(position) and math.isfinite(effort) and math.isfinite(velocity) and position >= 0):
        raise FingertipError("position, effort or velocity is no number, or the position is negative")
    return 1e3 * position, effort, 1e3 * velocity


class _Goal:
    """One that the grasp has taken. Raises FingertipError: it has not."""

    handle: Any
    future: Any  # of its result

    def __init__(self, left: str | None, action: Any, command: Any) -> None:
        self._width_mm, cap_N, speed_mm_s = _wanted(command)
        self.grasp, self._action, self._command = RunningGrasp(left), action, command
        try:
            self._look()
            self.grasp.states()  # of before
            self._opens = self._width_mm > self._now_mm + REACHED_mm
            self._has_begun = self._state in (("release",) if self._opens else _CLOSES + _HELD)
            settings = {"cap": cap_N, "approach": min(speed_mm_s, APPROACH_MOST_mm_s)}
            if self._opens:
                settings = {"open-width": self._width_mm, "release": speed_mm_s}
            elif self._state == "release":
                self.grasp.ask("hold")
            words = [f"{name}={value:.3f}" for name, value in settings.items() if value > 0]
            if self._opens or not self._has_begun:
                words.append("release" if self._opens else "grasp")
            if words:
                self.grasp.ask(" ".join(words))
        except FingertipError:
            self.grasp.close()
            raise

    def _look(self) -> None:
        """At the grasp. Raises GoneError."""
        report = self.grasp.report()
        self._state = report.get("state", "idle")
        self._now_mm, self._force_N = (float(report.get(name) or "nan") for name in ("width_mm", "force_N"))

    async def result(self, _: Any) -> Any:
        return await self.future

    def _is_reached(self) -> bool:
        return abs(self._now_mm - self._width_mm) <= REACHED_mm

    def follow(self) -> tuple[str, str] | None:
        """The event that ends it, with the reason. Raises FingertipError."""
        self._look()
        begins = ("release",) if self._opens else _CLOSES
        self._has_begun = self._has_begun or any(state in begins for state in self.grasp.states())
        if not self._has_begun or self._state in begins:  # a report may be of before the request
            if self._state == "approach" and self._now_mm <= self._width_mm:
                self.grasp.ask("hold")
            return None
        if self._state == "fault":
            return "abort", "the grasp has failed; `fingertip grasp` shows why"
        if self.handle.is_cancel_requested:
            return "canceled", "the width stays"
        is_good = (
            self._state == "open" if self._opens else self._state in _HELD or (self._state in ("still", "missed") and self._is_reached())
        )
        return "succeed" if is_good else "abort", self._state

    def message(self, kind: str, node: Any) -> Any:
        """kind: "Result" or "Feedback"."""
        message = getattr(self._action, kind)()
        position, effort = 1e-3 * self._now_mm, self._force_N
        if hasattr(message, "state"):
            message.state.header.stamp, message.state.name = node.get_clock().now().to_msg(), self._command.name
            message.state.position, message.state.effort = [position], [effort]
        else:
            message.position, message.effort = position, effort
        if hasattr(message, "stalled"):
            message.stalled, message.reached_goal = self._state in _HELD, self._is_reached()
        return message


class GripperAction:
    """The actions ~/gripper_cmd and ~/parallel_gripper_cmd of a node of yours, in its default callback group, which has to exclude itself. The
    executor may have one thread: a callback waits for the grasp's answer, some 20 ms, a second at most. left: as RunningGrasp has it. Raises
    InputError: there is no ROS 2."""

    def __init__(self, node: Any, left: str | None = None) -> None:
        self._node, self._left = node, left
        self._asked: _Goal | None = None
        self._goal: _Goal | None = None
        self._rclpy, actions = _ros("rclpy.action"), _ros("control_msgs.action")
        for kind, name in (("GripperCommand", "~/gripper_cmd"), ("ParallelGripperCommand", "~/parallel_gripper_cmd")):
            if action := getattr(actions, kind, None):
                callbacks = {"handle_accepted_callback": self._begin, "cancel_callback": self._cancel}
                callbacks["goal_callback"] = functools.partial(self._ask, action)
                self._rclpy.ActionServer(node, action, name, lambda handle: None, **callbacks)  # each goal brings its own to execute
        node.create_timer(POLL_s, self._follow)

    def _ask(self, action: Any, request: Any) -> Any:
        try:
            self._asked = _Goal(self._left, action, request.command)
        except FingertipError as error:
            self._node.get_logger().error(f"goal rejected: {error}")
            return self._rclpy.GoalResponse.REJECT
        return self._rclpy.GoalResponse.ACCEPT

    def _begin(self, handle: Any) -> None:
        goal = self._asked
        assert goal is not None
        self._end("abort", "a new goal has come")
        self._goal, goal.handle, goal.future = goal, handle, _ros("rclpy.task").Future(executor=self._node.executor)
        handle.execute(goal.result)

    def _cancel(self, handle: Any) -> Any:
        try:
            if self._goal and self._goal.handle == handle:
                self._goal.grasp.ask("hold")
                return self._rclpy.CancelResponse.ACCEPT
        except FingertipError as error:
            self._node.get_logger().error(f"not cancelled: {error}")
        return self._rclpy.CancelResponse.REJECT

    def _follow(self) -> None:
        if self._goal:
            try:
                end = self._goal.follow()
            except FingertipError as error:
                end = "abort", str(error)
            if end:
                self._end(*end)
            else:
                self._goal.handle.publish_feedback(self._goal.message("Feedback", self._node))

    def _end(self, event: str, reason: str) -> None:
        """Of the goal under way, if there is one."""
        goal, self._goal = self._goal, None
        if goal:
            self._node.get_logger().info(f"{event}: {reason}")
            getattr(goal.handle, event)()
            goal.future.set_result(goal.message("Result", self._node))
            goal.grasp.close()


def main(argv: list[str]) -> int:
    description = (
        "Serves a running `fingertip grasp` as an action of ROS 2. If several run: --ros-args -p left:=SERIAL of a left fingertip."
    )
    argparse.ArgumentParser(prog="fingertip-ros2-gripper", description=description).parse_known_args(argv)
    rclpy = _ros("rclpy")
    rclpy.init(args=argv)
    node = rclpy.create_node(NODE)
    GripperAction(node, node.declare_parameter("left", "").value or None)
    with contextlib.suppress(KeyboardInterrupt, _ros("rclpy.executors").ExternalShutdownException):
        rclpy.spin(node)
    return 0

#!/usr/bin/env python3
"""The grippers' lines against software of others: pyrobotiqgripper and Feetech's SDK drive the simulated
grippers, pymodbus is their client and our tool's server.

usage: test_gripper_judges.py FINGERTIP CELL_GRIPPER [unittest's]
"""

# real time: these programs wait by clocks of their own, and open a serial port, which here is a pseudo-terminal.
import asyncio
import contextlib
import os
import pty
import select
import subprocess
import sys
import threading
import tty
import unittest

import pyrobotiqgripper
import scservo_sdk
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient
from pymodbus.simulator import DataType, SimData, SimDevice
from pymodbus.server import ModbusSerialServer

FINGERTIP, CELL_GRIPPER = sys.argv[1:3]
# Of one answer: a machine that is held up for less fails nothing.
PATIENCE_s = 300
PATIENT = ("--timeout", "10000")  # the tool's most
scservo_sdk.port_handler.LATENCY_TIMER = 1000 * PATIENCE_s


@contextlib.contextmanager
def simulated(*options):
    """A simulated gripper's port."""
    with subprocess.Popen([CELL_GRIPPER, *options], stdout=subprocess.PIPE, text=True) as gripper:
        try:
            yield gripper.stdout.readline().strip()
        finally:
            gripper.terminate()
    assert gripper.returncode == 0, gripper.returncode


def tool(*arguments):
    done = subprocess.run([FINGERTIP, "gripper", *arguments], capture_output=True, text=True, timeout=3 * PATIENCE_s, check=False)
    assert done.returncode == 0, (arguments, done)
    return done.stdout


class Robotiq(unittest.TestCase):
    def test_pyrobotiqgripper_activates_and_moves_it(self):
        with simulated("--model", "2f85", "--object", "40") as port:
            gripper = pyrobotiqgripper.RobotiqGripper(com_port=port)
            gripper.readStatus(raiseOnFault=False)
            self.assertFalse(gripper.isActivated())
            gripper.activate()
            self.assertTrue(gripper.isActivated())
            gripper.open()
            self.assertEqual(gripper.position(), 3)
            gripper.move(100)
            self.assertEqual(gripper.position(), 100)
            self.assertEqual(gripper.status()["gOBJ"], 3)
            # 235 N at 10 N/mm are 23.5 mm into an object of 40 mm.
            gripper.close()
            self.assertAlmostEqual((230 - gripper.position()) * 85 / 227, 16.5, delta=0.2)
            self.assertEqual(gripper.status()["gOBJ"], 2)
            self.assertEqual(gripper.status()["gFLT"], 0)
            gripper.disconnect()

    def test_pymodbus_reads_it_by_every_function(self):
        with simulated("--model", "2f85") as port:
            client = ModbusSerialClient(port, baudrate=115200, timeout=PATIENCE_s)
            client.connect()
            silence = client.read_input_registers(2000, count=3, device_id=9).registers
            self.assertIn(silence[1] >> 8, (0, 9))
            expected = [0, 0, 3 << 8]
            self.assertEqual(client.read_input_registers(2000, count=3, device_id=9).registers, expected)
            self.assertEqual(client.read_holding_registers(2000, count=3, device_id=9).registers, expected)
            self.assertFalse(client.write_registers(1001, [0x55, 0], device_id=9).isError())
            self.assertEqual(
                client.readwrite_registers(read_address=2000, read_count=3, write_address=1001, values=[0x66, 0], device_id=9).registers,
                [0, 0x66, 3 << 8],
            )
            client.close()

    def test_pymodbus_serves_our_tool(self):
        """Two pseudo-terminals back to back; its registers say active, going, at 100 of 255."""
        status = [0xF900, 0, 100 << 8]
        with Bridge() as bridge, PymodbusServer(bridge.ends[0], status) as server:
            out = tool("info", "--model", "2f85", "--port", bridge.ends[1], *PATIENT)
            self.assertRegex(out, r"(?m)^active +yes$")
            self.assertRegex(out, r"(?m)^object +no$")
            self.assertRegex(out, rf"(?m)^width_mm +{130 * 85 / 227:.2f} of 85.0$")
            tool("move", "20", "--model", "2f85", "--port", bridge.ends[1], "--speed", "150", "--force", "20", *PATIENT)
            self.assertEqual(server.registers(1001, 2), [round(230 - 20 * 227 / 85), 0xFF00])
            self.assertEqual(server.registers(1000, 1), [0])  # nothing activated


class Feetech(unittest.TestCase):
    def test_the_makers_sdk_moves_it(self):
        with simulated("--model", "sts3215") as path:
            port = scservo_sdk.PortHandler(path)
            self.assertTrue(port.openPort())
            servo = scservo_sdk.sms_sts(port)

            def asked(call, *arguments):
                *values, result, error = call(*arguments)
                self.assertEqual((result, error), (scservo_sdk.COMM_SUCCESS, 0), (call.__name__, arguments))
                return values[0] if len(values) == 1 else values

            def rest():
                while asked(servo.ReadMoving, 6):
                    pass
                return asked(servo.ReadPos, 6)

            self.assertEqual(asked(servo.ping, 6), 777)
            self.assertEqual(rest(), 2700)
            # Without torque it stays.
            asked(servo.WritePosEx, 6, 2100, 2000, 50)
            self.assertEqual(rest(), 2700)
            asked(servo.write1ByteTxRx, 6, scservo_sdk.SMS_STS_TORQUE_ENABLE, 1)
            self.assertEqual(rest(), 2100)
            asked(servo.RegWritePosEx, 6, 2400, 2000, 50)
            self.assertEqual(rest(), 2100)
            servo.RegAction()
            self.assertEqual(rest(), 2400)
            self.assertTrue(servo.SyncWritePosEx(6, 2500, 2000, 50))
            servo.groupSyncWrite.txPacket()
            self.assertEqual(rest(), 2500)
            group = scservo_sdk.GroupSyncRead(servo, scservo_sdk.SMS_STS_PRESENT_POSITION_L, 4)
            self.assertTrue(group.addParam(6))
            self.assertEqual(group.txRxPacket(), scservo_sdk.COMM_SUCCESS)
            self.assertEqual(group.getData(6, scservo_sdk.SMS_STS_PRESENT_POSITION_L, 2), 2500)
            port.closePort()


class Bridge:
    """Two ports, each the other's far end."""

    def __enter__(self):
        self.masters, self.slaves = zip(*(pty.openpty() for _ in range(2)))
        for slave in self.slaves:
            tty.setraw(slave)
        self.ends = [os.ttyname(slave) for slave in self.slaves]
        self.ended, self.end = os.pipe()
        self.thread = threading.Thread(target=self.carry)
        self.thread.start()
        return self

    def carry(self):
        while True:
            for ready in select.select([*self.masters, self.ended], [], [])[0]:
                if ready == self.ended:
                    return
                os.write(self.masters[1 - self.masters.index(ready)], os.read(ready, 512))

    def __exit__(self, *_):
        os.write(self.end, b".")
        self.thread.join()
        for descriptor in (*self.masters, *self.slaves, self.ended, self.end):
            os.close(descriptor)


class PymodbusServer:
    """A slave 9 with these status registers, whatever it is told."""

    def __init__(self, port, status):
        self.port, self.status = port, status
        self.told = {}

    def trace(self, sending, pdu):
        if not sending:
            address, values = {16: lambda: (pdu.address, pdu.registers), 23: lambda: (pdu.write_address, pdu.write_registers)}.get(
                pdu.function_code, lambda: (0, [])
            )()
            self.told.update(enumerate(values, address))
        return pdu

    def registers(self, address, count):
        return [self.told.get(at, 0) for at in range(address, address + count)]

    async def serve(self, ready):
        device = SimDevice(
            9,
            [SimData(1000, values=[0, 0, 0], datatype=DataType.REGISTERS), SimData(2000, values=self.status, datatype=DataType.REGISTERS)],
        )
        self.server = ModbusSerialServer(device, framer=FramerType.RTU, port=self.port, baudrate=115200, trace_pdu=self.trace)
        self.loop = asyncio.get_running_loop()
        await self.server.serve_forever(background=True)
        ready.set()
        await self.server.serving

    def __enter__(self):
        ready = threading.Event()
        self.thread = threading.Thread(target=lambda: asyncio.run(self.serve(ready)))
        self.thread.start()
        assert ready.wait(60)
        return self

    def __exit__(self, *_):
        asyncio.run_coroutine_threadsafe(self.server.shutdown(), self.loop).result(60)
        self.thread.join()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])

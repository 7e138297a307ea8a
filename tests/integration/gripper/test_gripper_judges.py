#!/usr/bin/env python3
"""The grippers' lines against software of others: pyrobotiqgripper and Feetech's SDK drive the simulated grippers,
pymodbus is their client.

usage: test_gripper_judges.py CELL_GRIPPER [unittest's]
"""

# real time: these programs wait by clocks of their own, and open a serial port, which here is a pseudo-terminal.
import contextlib
import subprocess
import sys
import unittest

import pyrobotiqgripper
import scservo_sdk
from pymodbus.client import ModbusSerialClient

CELL_GRIPPER = sys.argv[1]
# Of one answer: a machine that is held up for less fails nothing.
PATIENCE_s = 300
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
            port.closePort()


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])

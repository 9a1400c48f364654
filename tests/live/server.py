"""A Modbus RTU server with units 1 and 2: pymodbus, on the serial port given."""

import sys

from pymodbus.datastore import ModbusDeviceContext, ModbusSequentialDataBlock, ModbusServerContext
from pymodbus.server import StartSerialServer


def unit():
    # Words of every kind: zero, small, large, text.
    words = [0, 1, 255, 256, 0xFFFF, 0x4142, 17000] * 40
    bits = [True, False, False, True] * 70
    return ModbusDeviceContext(
        di=ModbusSequentialDataBlock(1, bits),
        co=ModbusSequentialDataBlock(1, bits),
        hr=ModbusSequentialDataBlock(1, words),
        ir=ModbusSequentialDataBlock(1, words),
    )


StartSerialServer(
    context=ModbusServerContext(devices={1: unit(), 2: unit()}, single=False),
    port=sys.argv[1],
    baudrate=9600,
)

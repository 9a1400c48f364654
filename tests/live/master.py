"""A Modbus RTU master that asks units 1 and 2 one thing after the other: `master.py LIBRARY PORT`."""

import itertools
import sys
import time


def pymodbus(port):
    from pymodbus.client import ModbusSerialClient

    client = ModbusSerialClient(port, baudrate=9600, timeout=2)
    client.connect()
    questions = [
        lambda unit, n: client.read_holding_registers(n % 50, count=1 + n % 9, device_id=unit),
        lambda unit, n: client.read_input_registers(n % 50, count=1 + n % 9, device_id=unit),
        lambda unit, n: client.read_coils(n % 50, count=1 + n % 30, device_id=unit),
        lambda unit, n: client.read_discrete_inputs(n % 50, count=1 + n % 30, device_id=unit),
        lambda unit, n: client.write_register(n % 50, n & 0xFFFF, device_id=unit),
        lambda unit, n: client.write_coil(n % 50, n % 2 == 0, device_id=unit),
        lambda unit, n: client.write_registers(n % 50, [n & 0xFFFF, 0, 1], device_id=unit),
        lambda unit, n: client.write_coils(n % 50, [True, False, True], device_id=unit),
        lambda unit, n: client.read_holding_registers(5000, count=2, device_id=unit),
    ]
    for n, ask in zip(itertools.count(), itertools.cycle(questions)):
        ask(1 + n % 2, n)
        time.sleep(0.02)


def minimalmodbus(port):
    import minimalmodbus as library

    units = [library.Instrument(port, unit) for unit in (1, 2)]
    for unit in units:
        unit.serial.baudrate = 9600
        unit.serial.timeout = 2
    questions = [
        lambda unit, n: unit.read_register(n % 50),
        lambda unit, n: unit.read_registers(n % 50, 1 + n % 9),
        lambda unit, n: unit.read_float(n % 50),
        lambda unit, n: unit.read_bit(n % 50),
        lambda unit, n: unit.write_register(n % 50, n & 0x7FFF, functioncode=6),
        lambda unit, n: unit.write_bit(n % 50, n % 2),
        lambda unit, n: unit.write_registers(n % 50, [n & 0xFFFF, 7]),
    ]
    for n, ask in zip(itertools.count(), itertools.cycle(questions)):
        ask(units[n % 2], n)
        time.sleep(0.01)


{"pymodbus": pymodbus, "minimalmodbus": minimalmodbus}[sys.argv[1]](sys.argv[2])

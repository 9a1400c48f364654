//! D: what a device's manual asks of a master. V: what a device says.

use super::rules;

rules! { DEVICE:
D01 "wrong-function" Error Master
    "A register that the device serves with another function: 06 or 04 where it takes 16 or 03. These sensors know \
     03 and 16 only and do not answer others."
    "Use the function of the manual's table."
    "Manuals, 1.4 and 2.2"
D02 "off-by-one-register" Error Master
    "The start register is one beside a command's, and it was not answered, or answered with shifted values. The \
     remark that numbering starts from 1 (manuals, 2.1) holds for no frame of the manuals."
    "Use the register numbers of the manual as they are, as the address on the wire."
    "Manuals, 2.1 and 2.2"
D03 "wrong-quantity" Error Master
    "A quantity that no variant of the command takes: a part of the values, such as the error flag, is missing, or \
     the device does not answer."
    "Use the quantity of the manual's table."
    "Manuals, 2.2"
D04 "undocumented-register" Note Master
    "A register that the device's profile does not know. The vendor's own tools use some that no manual has."
    "Check the register; a serial number is at 0x0900 on single probes, at 0x1400 on the sonde."
    "Manuals, 2.2"
D05 "read-before-start" Warning Master
    "A measurement was read with no start seen on a device that needs one: it answers with old values or 0. Said \
     only when the beginning was seen, or the values show it; silent after damage or a hole that may hide the start."
    "Send the start command first; a library that refuses a quantity of 0 may have swallowed it."
    "Optical dissolved oxygen manual, 2.2.3 and 3"
D06 "read-too-early" Warning Master
    "A measurement was read before the warm-up that the manual asks for after the start. The first values are 0 or \
     old. Silent when damage may hide another start."
    "Wait as long as the manual says between start and the first read."
    "Manuals, 3"
D07 "polled-too-fast" Warning Master
    "Measurements were read faster than the manual's cycle: values repeat, averages mislead, and bus and lamp are \
     worn for nothing."
    "Wait the manual's cycle between two reads."
    "Manuals, 3"
D08 "read-after-stop" Warning Master
    "A measurement was read after a stop without a start between: the values are old."
    "Start before reading, or stop after the last read."
    "Optical dissolved oxygen manual, 2.2.6 and 3"
D09 "wrong-start-command" Error Master
    "The start command of another kind of device, or one to a device that has none. It is not answered."
    "Use the start command of the device's manual; sondes, pH and ORP probes have none."
    "Manuals, 2.2"
D10 "calibration-change" Warning Master
    "Calibration was written, with the old values where they were read before, and the new ones. It survives a loss \
     of power: an accident stays."
    "See that somebody meant it; read the values back."
    "Manuals, 2.2"
D11 "calibration-implausible" Error Master
    "A calibration was written with K zero, not a number, or beyond 0.2 to 5: every value that follows is useless."
    "Write K = 1 and B = 0 to get the values as measured, then calibrate anew."
    "Manuals, 2.2"
D12 "calibration-split" Error Master
    "K and B were written in two frames. They belong into one write of four registers; a part is refused or ignored."
    "Write K and B with one command."
    "Manuals, 2.2"
D13 "value-byte-order" Error Master
    "A value was written that makes sense only in the other byte order. These sensors take the least significant \
     byte first, and a new address in the first byte."
    "Swap the bytes of what is written; read it back."
    "Manuals, 1.5.1 and 2.2"
D14 "address-out-of-range" Error Master
    "A new unit address of 0 or above 247 was written. No master may address such a device."
    "Give an address from 1 to 247."
    "Manuals, 1.2.1 and 2.2"
D15 "old-address-used" Warning Master
    "Requests went to the old address, or to one mistaken between decimal and hexadecimal, after a device had \
     acknowledged a new one."
    "Let the master use the new address from the next request on."
    "Manuals, 2.2"
D16 "service-address-on-shared-bus" Error Master
    "0xFF, at which every sensor answers, was used while more than one device is on the bus. The answers collide; a \
     write reaches all: they then share one address."
    "Use 0xFF with a single sensor connected only."
    "Conductivity manual, 2.2.9"
D17 "read-while-brushing" Warning Master
    "A measurement was read while the brush sweeps, which is before the optics. Silent when damage may hide more."
    "Wait for the end of the sweep."
    "Manuals of the probes with wiper"
D18 "invalid-time" Error Master
    "A clock was set to something that is not binary coded decimal, or not a date."
    "Send second, minute, hour, day, month, 0, year, 0, each as two decimal digits in a byte."
    "Multi-parameter manual, 2.2.6"
D19 "missing-byte-count" Error Master
    "A write of zero registers was sent without its byte count: eight bytes where nine are due. The device does not \
     act on it."
    "Send the byte count 0 after the quantity, then the CRC over all seven bytes."
    "Manuals, 2.2; Modbus application protocol V1.1b3, 6.12"
D20 "settings-rewritten" Warning Master
    "The same setting was written again and again with the same value: settings are kept in memory that wears."
    "Read the setting, and write it only when it differs."
    "Manuals, 2.2"
D21 "service-answer-ignored" Warning Master
    "0xFF was asked again and again although it was answered: the answer comes from 0xFF, not from the unit address."
    "Take an answer from 0xFF for what it is."
    "Conductivity manual, 2.2.9"
D22 "broadcast-ignored" Warning Master
    "A write went to address 0. These devices never act on it."
    "Write to each device by its address."
    "Manuals, 1.2.1"
V01 "device-error-flag" Error Device
    "The device reported an error with its own flag, which is named."
    "Look the flag up in the manual; a brush that is stuck and a low supply are the usual ones."
    "Manuals, 2.2"
V02 "implausible-value" Warning Device
    "A value is not a number, infinite, or outside what is plausible for the quantity."
    "Check calibration and sensor; where all values are off, check that the device is of the kind shown."
    "The device's profile"
V03 "frozen-value" Warning Device
    "A value had the same bits over many polls while others moved: the sensor may be stuck, stopped or not in water."
    "Restart the measurement; check the sensor."
    "The device's profile"
V04 "power-loss-suspected" Warning Device
    "Something suggests that the device lost its power: silence right after a brush start, a clock that jumped, or \
     an interval back at its default. Silent when damage or a hole may hide what explains it."
    "Measure the supply at the device while the brush starts; long thin cables drop the voltage."
    "Manuals, 1.1 and 2.2"
}

//! L: the line and the adapter. F: frames.

use super::rules;

rules! { WIRE:
L01 "gap-in-frame" Warning Line
    "Inside a frame there was a silence longer than t1.5: 1.5 characters, of 11 bits each so that a sender with \
     parity or two stop bits is not wronged; 750 µs above 19200 baud. Said only when even the shortest silence that \
     the times allow is too long. A receiver that follows the specification discards such a frame."
    "Look for a sender that writes a frame in pieces: a slow loop, a serial server, an operating system that pauses."
    "Modbus over serial line V1.02, 2.5.1.1"
L02 "gap-too-short" Error Line
    "Less than t3.5 of silence lay between two frames: 3.5 characters, of 10 bits each. Said only when even the \
     longest silence that the times allow is too short. Receivers may take both frames for one. Above 19200 baud it \
     is an error under 3.5 characters, and a note from there to 1.750 ms."
    "Let the master wait at least t3.5 after an answer before it asks again."
    "Modbus over serial line V1.02, 2.5.1.1"
L03 "timing-not-measurable" Note Adapter
    "The adapter hands bytes over so coarsely that silences of t1.5 or t3.5 cannot be measured; L01 and L02 then \
     keep silent, except for what is certain all the same. Said once."
    "Set the latency timer of the adapter to 1 ms ('rtutap ports' shows it), or listen with a UART."
    "Modbus over serial line V1.02, 2.5.1.1"
L04 "line-error" Error Line
    "The UART reported a wrong parity or stop bit, or a break. Speed or character format may be wrong, two talkers \
     may overlap, or the wire is disturbed. A break as long as a character can be a driver that is switched late."
    "Compare speed and character format of all devices and of the listener; try '--line auto'; check wiring."
    "Modbus over serial line V1.02, 2.5.1"
L05 "stray-bytes" Warning Line
    "Bytes belong to no frame. One or a few, mostly 00 or FF, next to the edge of a frame come from a line that is \
     not held at rest: bias, termination, or a driver that is switched on or off. Many are a disturbance, another \
     speed or a collision."
    "Check bias resistors, termination at both ends, and when the drivers are enabled."
    "Modbus over serial line V1.02, 3.4"
L06 "local-echo" Note Adapter
    "Every request comes twice, byte for byte: the listener's adapter, or the master's, hears its own bytes."
    "Switch the echo of the adapter off (RE tied to DE on a transceiver does it)."
    "Modbus over serial line V1.02, 3.3"
L07 "bytes-lost" Error Adapter
    "Bytes were lost before they could be recorded: there is a hole. What is around it is judged with reserve."
    "Give the listener a faster machine or disk, or a UART with a larger buffer."
    "termios(3) and the adapter's documentation"
F01 "crc-error" Error Line
    "A frame is whole but for its CRC. The nearest explanation is given: a bit flipped, a byte lost, doubled or \
     swapped with its neighbour; where none fits, several bytes are damaged."
    "Check wiring, termination, ground and the length of stubs; look whether one device or direction is hit most."
    "Modbus over serial line V1.02, 2.5.1.2"
F02 "crc-of-another-address" Error Master
    "The CRC fits as soon as the address is another one: the frame was built with the CRC of a fixed address. Where \
     the very frame with that other address is common on the bus, a damaged address byte is likelier, and it is F01."
    "Let the master compute the CRC over the bytes that it sends, address included."
    "Modbus over serial line V1.02, 2.5.1.2 and appendix B"
F03 "crc-byte-order" Error Master
    "The CRC is right, but its two bytes are swapped: the low byte goes first."
    "Swap the CRC bytes of the sender."
    "Modbus over serial line V1.02, 2.5.1.2"
F04 "truncated" Error Line
    "A frame was cut short. A head is missing when the sender's driver, or the listener's receiver, is enabled too \
     late; a tail is missing when the driver is disabled before the last stop bit has left."
    "Measure DE/RE against the data: enable before the first start bit, hold until the last stop bit has left."
    "Modbus over serial line V1.02, 3.3"
F05 "unknown-function" Warning Master
    "A function code that neither the specification nor a profile knows."
    "Check whether the device documents it; a profile (--profile) can declare it."
    "Modbus application protocol V1.1b3, 5"
F06 "reserved-address" Warning Master
    "An address from 248 to 255, which the specification reserves, and which no profile names as service address."
    "Check the address; the units of a bus have 1 to 247."
    "Modbus over serial line V1.02, 2.2"
}

//! T: requests and answers. M: the specification of requests. Q: quirks.

use super::rules;

rules! { CONVERSATION:
T01 "no-response" Error Device
    "A request stayed without an answer. Classified by what the same device does otherwise: an address that never \
     answered, one that has been silent since, or one that answers other requests: these sensors answer nothing to \
     a register that they do not have, and then the master is to blame."
    "Check address, power and wiring of a silent device; where others are answered, register, quantity and function."
    "Modbus over serial line V1.02, 2.4.1"
T02 "late-response" Error Device
    "The answer came after the master had gone on to another request: it waited too short, or the device is slow. \
     The answer may be taken for that of the next request."
    "Give the master a longer response time-out than the slowest answer of the device."
    "Modbus over serial line V1.02, 2.4.1"
T03 "unsolicited-response" Warning Line
    "A response that nobody asked for: the request was not heard, or two masters or devices share an address."
    "See whether something damaged stands before it; check that the listener hears both directions."
    "Modbus over serial line V1.02, 2.1"
T04 "exception" Error Device
    "The device refused a request with an exception. Yosemitech sensors rather stay silent."
    "Read the exception's name: function, address, quantity or state of the device."
    "Modbus application protocol V1.1b3, 7"
T05 "response-mismatch" Error Device
    "The response does not fit its request: another byte count, or another register or quantity echoed."
    "Compare the quantity asked for with the device's manual; look for a second device at the address."
    "Modbus application protocol V1.1b3, 6"
T06 "retry-storm" Warning Master
    "The same request was sent three times and more without an answer. Where these sensors do not know a register \
     they stay silent for ever: repeating does not help, and it keeps others waiting."
    "Give up after two retries, and mark the device or register as not there."
    "Modbus over serial line V1.02, 2.4.1"
T07 "two-answers" Error Line
    "A request was answered twice: two devices have the same address."
    "Connect the devices one at a time and give each an address of its own."
    "Modbus over serial line V1.02, 2.2"
T08 "collision" Error Line
    "Damaged bytes stand where an answer is due, and more of them than the answer has: several talkers at once. Two \
     devices at one address, a request to all at 0xFF, or a second master."
    "Connect the devices one at a time; see that no two have the same address."
    "Modbus over serial line V1.02, 2.1"
T09 "two-masters" Error Master
    "A request began while the answer to another was still due, although this device usually answers in that time \
     and the master usually waits for it: a second master may be on the bus."
    "Look for another PLC, gateway or program; only one master may talk."
    "Modbus over serial line V1.02, 2.1"
M01 "quantity-out-of-range" Error Master
    "A quantity that the specification does not allow for the function, and that no profile declares."
    "Ask for 1 to 125 registers, write 1 to 123; 1 to 2000 coils, write 1 to 1968."
    "Modbus application protocol V1.1b3, 6"
M02 "broadcast-read" Error Master
    "A read was sent to address 0. Broadcasts are for writes; nobody answers one."
    "Ask each unit by its address."
    "Modbus over serial line V1.02, 2.1"
M03 "byte-count-mismatch" Error Master
    "A write of several registers gives a byte count that is not twice its quantity."
    "Set the byte count to twice the quantity, and send as many bytes."
    "Modbus application protocol V1.1b3, 6.12"
Q01 "quirk-in-use" Note Device
    "A frame outside the specification that this device's manual asks for, such as a read of zero registers. It is \
     right for the device; other equipment on the bus may stumble. Noted once."
    "Nothing to mend; libraries that refuse it need a way round."
    "The device's manual, as its profile says"
}

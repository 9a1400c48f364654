//! P: what a master was expected to do.

use super::rules;

rules! { PLAN:
P01 "device-not-polled" Error Master
    "The plan has a device at an address to which the master sent nothing at all, or nothing for longer than the plan \
     allows. A hole in the recording interrupts the wait."
    "Add the device to the master, or take it out of the plan."
    "The plan given with --expect"
P02 "unplanned-device" Warning Master
    "The master asked an address that the plan does not have."
    "Check the address; add it to the plan if it is meant."
    "The plan given with --expect"
P03 "missing-command" Error Master
    "The plan has a command that the master never sent to the device, although there was time for it."
    "Let the master send it, or take it out of the plan."
    "The plan given with --expect"
P04 "unplanned-command" Warning Master
    "The master sent a request that the plan does not have for the device."
    "Check register, function and quantity; add it to the plan if it is meant."
    "The plan given with --expect"
P05 "rate-off-plan" Warning Master
    "A command came more often or less often than the plan allows on average, or came no more."
    "Check the poll interval of the master."
    "The plan given with --expect"
P06 "order-off-plan" Warning Master
    "Commands came in another order than the plan gives. Silent after damage or a hole."
    "Check the sequence of the master."
    "The plan given with --expect"
P07 "latency-off-plan" Warning Device
    "An answer took longer than the plan allows, certain beyond the uncertainty of the times. A single slow answer \
     has to be 50 ms beyond, for the listener may have paused; behind an adapter that is not known, each has to be \
     100 ms beyond."
    "Check the device and what stands between, such as a gateway."
    "The plan given with --expect"
P08 "device-off-plan" Error Device
    "Another kind of device than the plan has is at an address."
    "Check which device was installed, and its address."
    "The plan given with --expect"
}

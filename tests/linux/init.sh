#!/bin/busybox sh
# Init of the virtual machine: loads the USB drivers, then runs what comes over the second serial port.
#   request:  a line "ID BASE64-OF-A-SCRIPT"
#   answer:   a line "ID STATUS LENGTH", then LENGTH bytes: what the script printed
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t devtmpfs devtmpfs /dev
mount -t tmpfs tmpfs /tmp
for module in usb-common usbcore xhci-hcd xhci-pci cdc-acm; do
  insmod /modules/$module.ko
done
exec < /dev/ttyS1 > /dev/ttyS1 2> /dev/console
stty raw -echo
# This first process inherits what scripts leave behind, and the end of such a child would cut short what its shell is reading. So another reads.
(
  echo ready
  while read -r id script; do
    echo "$script" | base64 -d > /tmp/script
    sh /tmp/script < /dev/null > /tmp/output 2>&1
    status=$?
    echo "$id $status $(wc -c < /tmp/output)"
    cat /tmp/output
  done
) < /dev/ttyS1 &
wait

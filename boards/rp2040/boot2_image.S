/* The second boot stage as the boot ROM wants it: padded, with its CRC. */
  .section .boot2, "a"
  .incbin "boot2.bin"

#include "rp2040/gpio.h"

#include "rp2040/reg.h"

#define IO_BANK0_CTRL(pin) (0x40014004u + 8u * (pin))

#define IO_OEOVER_DISABLE (2u << 12)
#define IO_INOVER_HIGH (3u << 16)

#define PADS_BANK0_GPIO(pin) (0x4001c004u + 4u * (pin))
#define PAD_INPUT_ENABLE (1u << 6)
#define PAD_DRIVE_4_MA (1u << 4)
#define PAD_PULL_UP (1u << 3)
#define PAD_PULL_DOWN (1u << 2)
#define PAD_SCHMITT (1u << 1)

#define SIO_GPIO_IN 0xd0000004u
#define SIO_GPIO_OUT_SET 0xd0000014u
#define SIO_GPIO_OUT_CLR 0xd0000018u
#define SIO_GPIO_OE_SET 0xd0000024u
#define SIO_GPIO_OE_CLR 0xd0000028u

void gpio_set_pad(unsigned pin, enum gpio_pull pull) {
  REG32(PADS_BANK0_GPIO(pin)) = PAD_INPUT_ENABLE | PAD_DRIVE_4_MA | PAD_SCHMITT | (pull == GPIO_PULL_UP ? PAD_PULL_UP : 0) |
                                (pull == GPIO_PULL_DOWN ? PAD_PULL_DOWN : 0);
}

void gpio_set_function(unsigned pin, enum gpio_function function) { REG32(IO_BANK0_CTRL(pin)) = (uint32_t)function; }

void gpio_set_function_reading_high(unsigned pin, enum gpio_function function) {
  REG32(IO_BANK0_CTRL(pin)) = (uint32_t)function | IO_OEOVER_DISABLE | IO_INOVER_HIGH;
}

void gpio_write(unsigned pin, bool high) { REG32(high ? SIO_GPIO_OUT_SET : SIO_GPIO_OUT_CLR) = UINT32_C(1) << pin; }

void gpio_drive(unsigned pin, bool enabled) { REG32(enabled ? SIO_GPIO_OE_SET : SIO_GPIO_OE_CLR) = UINT32_C(1) << pin; }

bool gpio_read(unsigned pin) { return (REG32(SIO_GPIO_IN) >> pin & 1u) != 0; }

/* The USB controller as a device: the registers and bits used here (RP2040 datasheet 4.1.3 DPRAM,
 * 4.1.4 registers). `endpoint` is an endpoint address. */
#pragma once

#include "rp2040/reg.h"

#define USB_NUMBER(endpoint) (15u & (uint32_t)(endpoint))
#define USB_OUT(endpoint) (0x80u & (endpoint) ? 0u : 1u)

/* Bit of the endpoint in BUFF_STATUS, EP_ABORT and EP_ABORT_DONE */
#define USB_BIT(endpoint) (1u << (2u * USB_NUMBER(endpoint) + USB_OUT(endpoint)))

/* DPRAM */
#define USB_DPRAM_BASE 0x50100000u
#define USB_DPRAM_BYTES 4096u
#define USB_SETUP_PACKET USB_DPRAM_BASE

#define USB_ENDPOINT_CONTROL(endpoint) REG32(USB_DPRAM_BASE + 8u * USB_NUMBER(endpoint) + 4u * USB_OUT(endpoint)) /* not endpoint 0 */
#define USB_ENDPOINT_CONTROL_ENABLE (1u << 31)
#define USB_ENDPOINT_CONTROL_INTERRUPT (1u << 29) /* for each buffer */
#define USB_ENDPOINT_CONTROL_TYPE(type) ((uint32_t)(type) << 26)

#define USB_BUFFER_CONTROL(endpoint) REG32(USB_DPRAM_BASE + 0x80u + 8u * USB_NUMBER(endpoint) + 4u * USB_OUT(endpoint))
#define USB_BUFFER_FULL (1u << 15)
#define USB_BUFFER_DATA1 (1u << 13)
#define USB_BUFFER_STALL (1u << 11)
#define USB_BUFFER_AVAILABLE (1u << 10)
#define USB_BUFFER_LENGTH 0x3ffu

/* Offsets of the packet buffers; endpoint 0 has one for both directions, at a fixed place. */
#define USB_BUFFER_OFFSET(endpoint)                                                                                                        \
  (USB_NUMBER(endpoint) == 0 ? 0x100u : 0x180u + 64u * (2u * (USB_NUMBER(endpoint) - 1u) + USB_OUT(endpoint)))

/* Registers */
#define USB_BASE 0x50110000u
#define USB_ADDR_ENDP REG32(USB_BASE + 0x00u)
#define USB_MAIN_CTRL REG32(USB_BASE + 0x40u)
#define USB_MAIN_CTRL_CONTROLLER_EN (1u << 0)
#define USB_SOF_RD REG32(USB_BASE + 0x48u) /* reading it clears the SOF interrupt */
#define USB_SIE_CTRL (USB_BASE + 0x4cu)
#define USB_SIE_CTRL_EP0_INT_1BUF (1u << 29)
#define USB_SIE_CTRL_PULLUP_EN (1u << 16)
#define USB_SIE_STATUS (USB_BASE + 0x50u)
#define USB_SIE_STATUS_BUS_RESET (1u << 19)
#define USB_SIE_STATUS_SETUP_REC (1u << 17)
#define USB_SIE_STATUS_CONNECTED (1u << 16)
#define USB_SIE_STATUS_RESUME (1u << 11)
/* Reads whether the bus is suspended; writing a 1 clears INTS.DEV_SUSPEND, which reports that this has
 * changed (pico-sdk, hardware/regs/usb.h). */
#define USB_SIE_STATUS_SUSPENDED (1u << 4)
#define USB_SIE_STATUS_LINES (3u << 2) /* 0: both are low */
#define USB_BUFF_STATUS (USB_BASE + 0x58u)
#define USB_EP_ABORT (USB_BASE + 0x60u)
#define USB_EP_ABORT_DONE (USB_BASE + 0x64u)
#define USB_EP_STALL_ARM REG32(USB_BASE + 0x68u)
#define USB_EP_STALL_ARM_BOTH 3u
#define USB_MUXING REG32(USB_BASE + 0x74u)
#define USB_MUXING_TO_PHY (1u << 0)
#define USB_MUXING_TO_PADS (1u << 2) /* GPIO15 and 16, with their function 8 */
#define USB_MUXING_SOFTCON (1u << 3)
#define USB_PWR REG32(USB_BASE + 0x78u)
#define USB_PWR_VBUS_DETECT (1u << 2)
#define USB_PWR_VBUS_DETECT_OVERRIDE_EN (1u << 3)
#define USB_PHY_DIRECT (USB_BASE + 0x7cu)
#define USB_PHY_DIRECT_OVERRIDE (USB_BASE + 0x80u)
#define USB_PHY_DIRECT_DP_PULLUP_EN (1u << 1)
#define USB_PHY_DIRECT_OVERRIDE_DP_PULLUP_EN (1u << 2)
#define USB_INTR REG32(USB_BASE + 0x8cu) /* masked by nothing */
#define USB_INTE (USB_BASE + 0x90u)
#define USB_INTS REG32(USB_BASE + 0x98u)
#define USB_INT_DEV_SOF (1u << 17)
#define USB_INT_SETUP_REQ (1u << 16)
#define USB_INT_DEV_RESUME (1u << 15)
#define USB_INT_DEV_SUSPEND (1u << 14)
#define USB_INT_BUS_RESET (1u << 12)
#define USB_INT_BUFF_STATUS (1u << 4)

"""The pins of a Raspberry Pi Pico (its data sheet, "Pinout and design files"; Pico H and Pico W have the same)."""

PINS = (
    "GP0 GP1 GND GP2 GP3 GP4 GP5 GND GP6 GP7 GP8 GP9 GND GP10 GP11 GP12 GP13 GND GP14 GP15 "
    "GP16 GP17 GND GP18 GP19 GP20 GP21 GND GP22 RUN GP26 GP27 AGND GP28 ADC_VREF 3V3 3V3_EN GND VSYS VBUS"
).split()


def pin(name):
    return PINS.index(name) + 1


def grounds():
    return [i + 1 for i, name in enumerate(PINS) if name == "GND"]

#include "rp2040/nvic.h"

#include "rp2040/reg.h"

#define NVIC_ISER 0xe000e100u
#define NVIC_ICER 0xe000e180u
#define NVIC_ISPR 0xe000e200u
#define NVIC_ICPR 0xe000e280u
#define NVIC_IPR 0xe000e400u /* four lines a word */

void rp2040_irq_set_priorities(void) {
  extern const uint32_t rp2040_irq_priorities[8];
  for (uint32_t i = 0; i < 8; i++)
    REG32(NVIC_IPR + 4 * i) = rp2040_irq_priorities[i];
}

void rp2040_irq_enable(unsigned irq) {
  REG32(NVIC_ICPR) = UINT32_C(1) << irq;
  REG32(NVIC_ISER) = UINT32_C(1) << irq;
}

void rp2040_irq_disable(unsigned irq) { REG32(NVIC_ICER) = UINT32_C(1) << irq; }

void rp2040_irq_pend(unsigned irq) { REG32(NVIC_ISPR) = UINT32_C(1) << irq; }

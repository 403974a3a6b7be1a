/* Start of a program on an emulated Cortex-M: data into memory, then main; what it prints goes to the emulator's host. */
#include <stdint.h>
#include <stdlib.h>

extern uint32_t _estack, _sidata, _sdata, _edata, _sbss, _ebss;
extern void initialise_monitor_handles(void);
int main(void);

void reset(void)
{
#if defined(__ARM_FP)
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* switch the floating-point unit on */
    __asm volatile("dsb\n isb");
#endif
    uint32_t *from = &_sidata;
    for (uint32_t *to = &_sdata; to < &_edata; to++)
    {
        *to = *from++;
    }
    for (uint32_t *to = &_sbss; to < &_ebss; to++)
    {
        *to = 0;
    }
    initialise_monitor_handles();
    exit(main());
}

static void stuck(void)
{
    for (;;)
    {
    }
}

__attribute__((section(".vectors"), used)) void *const vectors[16] = {
    &_estack, (void *)reset, (void *)stuck, (void *)stuck, (void *)stuck, (void *)stuck, (void *)stuck, 0, 0, 0, 0,
    (void *)stuck, (void *)stuck, 0, (void *)stuck, (void *)stuck};

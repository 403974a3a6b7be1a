/* The self-test of a folder with every call of NAME_step counted: instructions, and how deep the stack goes. */
#include "NAME.h"

#include <stdio.h>

#define COUNTER ((volatile uint32_t *)0xE000E010u) /* SysTick, which the emulator advances by instructions */
#define REPEATS 40u                                /* of a call: one tick is some tens of instructions */
#define PAINTED 4096u

typedef void call(NAME_memory *memory, const NAME_input *input, NAME_output *output);

static uint32_t calls, total, most, deepest;

/* What a call costs that does nothing: what is counted around every call, too. */
__attribute__((noipa)) static void nothing(NAME_memory *memory, const NAME_input *input, NAME_output *output)
{
    (void)memory;
    (void)input;
    (void)output;
}

__attribute__((noipa)) static uint32_t ticks(call *made, const NAME_memory *memory, const NAME_input *input)
{
    NAME_memory copy;
    NAME_output output;
    const uint32_t begun = COUNTER[2];
    for (uint32_t k = 0; k < REPEATS; k++)
    {
        copy = *memory;
        made(&copy, input, &output);
    }
    return (begun - COUNTER[2]) & 0xFFFFFFu;
}

/* Bytes below this function's own that a call writes. */
__attribute__((noipa)) static uint32_t depth(call *made, const NAME_memory *memory, const NAME_input *input)
{
    NAME_memory copy = *memory;
    NAME_output output;
    volatile uint8_t *top;
    uint32_t place = PAINTED;
    __asm volatile("mov %0, sp" : "=r"(top));
    for (uint32_t k = 1; k <= PAINTED; k++)
    {
        top[-(int32_t)k] = 0xA5u;
    }
    made(&copy, input, &output);
    while ((place > 0u) && (top[-(int32_t)place] == 0xA5u))
    {
        place--;
    }
    return place;
}

/* Ticks of two million instructions. */
__attribute__((noipa)) static uint32_t scale(void)
{
    uint32_t left = 1000000u;
    const uint32_t begun = COUNTER[2];
    __asm volatile(".syntax unified\n1: subs %0, #1\n bne 1b" : "+l"(left) : : "cc");
    return (begun - COUNTER[2]) & 0xFFFFFFu;
}

static void counted(NAME_memory *memory, const NAME_input *input, NAME_output *output)
{
    const uint32_t spent = ticks(NAME_step, memory, input) - ticks(nothing, memory, input);
    const uint32_t deep = depth(NAME_step, memory, input);
    calls++;
    total += spent;
    most = (spent > most) ? spent : most;
    deepest = (deep > deepest) ? deep : deepest;
    NAME_step(memory, input, output);
}

#define NAME_step counted
#define main self_test
#include "self_test.c"
#undef main

int main(void)
{
    COUNTER[1] = 0xFFFFFFu;
    COUNTER[2] = 0u;
    COUNTER[0] = 5u;
    const int wrong = self_test();
    printf("counted %lu %lu %lu %lu %lu %lu\n", (unsigned long)calls, (unsigned long)total, (unsigned long)most,
           (unsigned long)deepest, (unsigned long)REPEATS, (unsigned long)scale());
    return wrong;
}

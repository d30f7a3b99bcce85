// SPDX-License-Identifier: Apache-2.0
#include "tests/cuda_emulation/fiber.h"

#include "tests/cuda_emulation/address_sanitizer.h"

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <pthread.h>
#include <sys/mman.h>

// void switch(void** save, void* load): pushes what a call preserves, stores the stack pointer, and the reverse.
extern "C" void gsc_emulation_switch(void** save, void* load) __asm__("gsc_emulation_switch");

#if defined(__x86_64__)
__asm__(R"(
.text
.globl gsc_emulation_switch
gsc_emulation_switch:
    pushq %rbp
    pushq %rbx
    pushq %r12
    pushq %r13
    pushq %r14
    pushq %r15
    movq %rsp, (%rdi)
    movq %rsi, %rsp
    popq %r15
    popq %r14
    popq %r13
    popq %r12
    popq %rbx
    popq %rbp
    ret
)");
#elif defined(__aarch64__)
__asm__(R"(
.text
.globl gsc_emulation_switch
gsc_emulation_switch:
    sub sp, sp, #160
    stp x19, x20, [sp, #0]
    stp x21, x22, [sp, #16]
    stp x23, x24, [sp, #32]
    stp x25, x26, [sp, #48]
    stp x27, x28, [sp, #64]
    stp x29, x30, [sp, #80]
    stp d8, d9, [sp, #96]
    stp d10, d11, [sp, #112]
    stp d12, d13, [sp, #128]
    stp d14, d15, [sp, #144]
    mov x9, sp
    str x9, [x0]
    mov sp, x1
    ldp x19, x20, [sp, #0]
    ldp x21, x22, [sp, #16]
    ldp x23, x24, [sp, #32]
    ldp x25, x26, [sp, #48]
    ldp x27, x28, [sp, #64]
    ldp x29, x30, [sp, #80]
    ldp d8, d9, [sp, #96]
    ldp d10, d11, [sp, #112]
    ldp d12, d13, [sp, #128]
    ldp d14, d15, [sp, #144]
    add sp, sp, #160
    ret
)");
#else
#error "the CUDA emulation knows x86-64 and aarch64 only"
#endif

namespace gsc_emulation {

namespace {

constexpr size_t kStackBytes = 256 << 10; // a sanitizer's frames are large; pages not touched cost nothing
constexpr size_t kGuardBytes = 64 << 10;  // below it, whatever the page size

} // namespace

Fiber makeFiber(void (*entry)())
{
    void* memory = mmap(nullptr, kGuardBytes + kStackBytes, PROT_READ | PROT_WRITE,
                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED || mprotect(memory, kGuardBytes, PROT_NONE) != 0) {
        std::fprintf(stderr, "cuda emulation: no memory for the stack of a thread\n");
        std::abort();
    }
    Fiber fiber;
    fiber.bottom = static_cast<char*>(memory) + kGuardBytes;
    fiber.bytes = kStackBytes;
    auto* top = reinterpret_cast<uint64_t*>(static_cast<char*>(memory) + kGuardBytes + kStackBytes);
#if defined(__x86_64__)
    uint64_t* sp = top - 8; // six registers, where to return to, and a null return address as a caller would leave it
    sp[6] = reinterpret_cast<uint64_t>(entry);
#else
    uint64_t* sp = top - 20;
    sp[11] = reinterpret_cast<uint64_t>(entry); // x30
#endif
    fiber.stack_pointer = sp;
    return fiber;
}

Fiber callersFiber()
{
    Fiber fiber;
#if defined(GSC_POISONS) && defined(__linux__)
    static thread_local const void* bottom = nullptr;
    static thread_local size_t bytes = 0;
    if (bottom == nullptr) {
        pthread_attr_t attributes;
        void* start = nullptr;
        pthread_getattr_np(pthread_self(), &attributes);
        pthread_attr_getstack(&attributes, &start, &bytes);
        pthread_attr_destroy(&attributes);
        bottom = start;
    }
    fiber.bottom = bottom;
    fiber.bytes = bytes;
#endif
    return fiber;
}

void enterFiber()
{
#ifdef GSC_POISONS
    __sanitizer_finish_switch_fiber(nullptr, nullptr, nullptr);
#endif
}

void switchFiber(Fiber& from, const Fiber& to)
{
#ifdef GSC_POISONS
    __sanitizer_start_switch_fiber(&from.fake_stack, to.bottom, to.bytes);
#endif
    gsc_emulation_switch(&from.stack_pointer, to.stack_pointer);
#ifdef GSC_POISONS
    __sanitizer_finish_switch_fiber(from.fake_stack, nullptr, nullptr);
#endif
}

} // namespace gsc_emulation

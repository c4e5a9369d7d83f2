@ Start-up code from reset to `after_reset`: enables the FPU before any compiled function can use it, then initialises RAM.
@ The linker script defines the ends of the sections.
.section .text.reset, "ax"
.global reset
.type reset, %function
.thumb_func
reset:
movw r0, #0xED88
movt r0, #0xE000
ldr r1, [r0]
orr r1, r1, #0xF00000
str r1, [r0]
dsb
isb
ldr r0, =__bss_start
ldr r1, =__bss_end
movs r2, #0
1:
cmp r0, r1
beq 2f
stmia r0!, {r2}
b 1b
2:
ldr r0, =__data_start
ldr r1, =__data_end
ldr r2, =__data_load
3:
cmp r0, r1
beq 4f
ldmia r2!, {r3}
stmia r0!, {r3}
b 3b
4:
bl after_reset
b .
.pool

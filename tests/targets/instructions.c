// A plugin of QEMU that counts the instructions of a program: at each of its calls of `write`, those since the last
// one. QEMU's header is in no package, so what is used of it (its version 1) is declared here.
#include <inttypes.h>
#include <stdio.h>

struct qemu_plugin_tb;
typedef void (*on_block)(uint64_t plugin, struct qemu_plugin_tb *block);
typedef void (*on_call)(uint64_t plugin, unsigned cpu, int64_t number, uint64_t a, uint64_t b, uint64_t c, uint64_t d,
                        uint64_t e, uint64_t f, uint64_t g, uint64_t h);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *block);
void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t plugin, on_block call);
void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb *block, int add, void *to, uint64_t by);
void qemu_plugin_register_vcpu_syscall_cb(uint64_t plugin, on_call call);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

enum { WRITE = 64, ADD = 0 };
static uint64_t executed, last;

static void translated(uint64_t plugin, struct qemu_plugin_tb *block) {
    (void)plugin;
    qemu_plugin_register_vcpu_tb_exec_inline(block, ADD, &executed, qemu_plugin_tb_n_insns(block));
}

static void called(uint64_t plugin, unsigned cpu, int64_t number, uint64_t a, uint64_t b, uint64_t c, uint64_t d,
                   uint64_t e, uint64_t f, uint64_t g, uint64_t h) {
    (void)plugin, (void)cpu, (void)a, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g, (void)h;
    if (number != WRITE) return;
    fprintf(stderr, "instructions %" PRIu64 "\n", executed - last);
    last = executed;
}

__attribute__((visibility("default"))) int qemu_plugin_install(uint64_t plugin, const void *info, int count,
                                                               char **arguments) {
    (void)info, (void)count, (void)arguments;
    qemu_plugin_register_vcpu_tb_trans_cb(plugin, translated);
    qemu_plugin_register_vcpu_syscall_cb(plugin, called);
    return 0;
}

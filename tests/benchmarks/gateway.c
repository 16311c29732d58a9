/* What an experienced integrator would write instead of gatewayd: one poll() loop, raw RTDE on one side, a mapping of
 * libmodbus on the other. The full image of image.py at its addresses, in and out; no owners, no limits, no freshness.
 * Usage: gateway ROBOT_PORT PORT, both on 127.0.0.1. Ends when the robot does: systemd would start it again.
 * Build: cc -O2 -o gateway gateway.c $(pkg-config --cflags --libs libmodbus) */
#include <arpa/inet.h>
#include <modbus.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FREQUENCY = 500, PEERS = 64, INPUTS = 10, OUTPUTS = 200, LAST_INPUT = INPUTS + 48 + 96 };
enum { VERSION = 'V', START = 'S', SET_OUTPUTS = 'O', SET_INPUTS = 'I', DATA = 'U' };

static const char *const STATE[] = {
    "actual_q", "actual_qd", "actual_current", "actual_TCP_pose", "actual_TCP_speed", "actual_TCP_force", "target_q",
    "target_TCP_pose", "joint_temperatures", "actual_execution_time", "actual_main_voltage", "actual_robot_voltage",
    "actual_robot_current", "actual_momentum", "actual_digital_input_bits", "actual_digital_output_bits", "robot_mode",
    "safety_mode", "runtime_state", "speed_scaling",
};
static struct { int address, registers, swapped; } outputs[128];
static int output_count;
static uint16_t *image;
static int robot;
static uint8_t input_recipe;

static void fail(const char *what)
{
    perror(what);
    exit(1);
}

static void get(uint8_t *into, size_t size)
{
    if (recv(robot, into, size, MSG_WAITALL) != (ssize_t)size)
        fail("robot");
}

static void put(int type, const void *payload, size_t size)
{
    uint8_t package[8192] = {(size + 3) >> 8, size + 3, type};
    memcpy(package + 3, payload, size);
    if (send(robot, package, size + 3, MSG_NOSIGNAL) != (ssize_t)(size + 3))
        fail("robot");
}

/* The next package; its payload's size. */
static size_t take(uint8_t *payload, int *type)
{
    uint8_t header[3];
    get(header, 3);
    size_t size = (header[0] << 8 | header[1]) - 3;
    get(payload, size);
    *type = header[2];
    return size;
}

static size_t ask(int type, const void *payload, size_t size, uint8_t *answer)
{
    int came;
    put(type, payload, size);
    do
        size = take(answer, &came);
    while (came != type);
    return size;
}

static void place(int address, int registers, int swapped)
{
    outputs[output_count].address = address;
    outputs[output_count].registers = registers;
    outputs[output_count++].swapped = swapped;
}

static char *registers_of(char *names, const char *way)
{
    names += sprintf(names, "%s_bit_registers0_to_31,%s_bit_registers32_to_63", way, way);
    for (int number = 0; number < 24; number++)
        names += sprintf(names, ",%s_int_register_%d", way, number);
    for (int number = 0; number < 24; number++)
        names += sprintf(names, ",%s_double_register_%d", way, number);
    return names;
}

static void set_up(void)
{
    uint8_t answer[65536];
    char recipe[8192];
    uint64_t frequency = 0;
    double hertz = FREQUENCY;
    memcpy(&frequency, &hertz, 8);
    frequency = __builtin_bswap64(frequency);
    memcpy(recipe, &frequency, 8);
    char *end = registers_of(recipe + 8 + sprintf(recipe + 8, "timestamp,"), "output");
    place(0, 4, -1);
    for (int word = 0; word < 2; word++)
        place(OUTPUTS + 2 * word, 2, 1);
    for (int number = 0; number < 24; number++)
        place(210 + 2 * number, 2, 0);
    for (int number = 0; number < 24; number++)
        place(300 + 4 * number, 4, 0);
    for (int field = 0, address = 396; field < 20; field++) {
        end += sprintf(end, ",%s", STATE[field]);
        place(address, field < 9 ? 24 : field >= 16 && field < 19 ? 2 : 4, 0);
        address += field < 9 ? 24 : 4;
    }
    if (!ask(VERSION, "\0\2", 2, answer) || !answer[0])
        fail("protocol version 2");
    ask(SET_OUTPUTS, recipe, end - recipe, answer);
    size_t size = ask(SET_INPUTS, recipe, registers_of(recipe, "input") - recipe, answer);
    input_recipe = answer[0];
    answer[size] = 0;
    if (!input_recipe || strstr((char *)answer + 1, "IN_USE") || !ask(START, "", 0, answer) || !answer[0])
        fail("set-up");
}

/* One package of the robot into the mapping: both are big-endian words. */
static void show(const uint8_t *payload)
{
    for (int number = 0; number < output_count; number++) {
        int count = outputs[number].registers, swapped = outputs[number].swapped;
        for (int word = 0; word < count && swapped >= 0; word++)
            image[outputs[number].address + (swapped ? count - 1 - word : word)] =
                payload[2 * word] << 8 | payload[2 * word + 1];
        payload += 2 * count;
    }
}

static void send_inputs(void)
{
    uint8_t payload[1 + 8 + 2 * (48 + 96)] = {input_recipe}, *next = payload + 1;
    static const int bits[] = {1, 0, 3, 2};
    for (int word = 0; word < 4; word++, next += 2)
        next[0] = image[bits[word]] >> 8, next[1] = image[bits[word]];
    for (int word = INPUTS; word < LAST_INPUT; word++, next += 2)
        next[0] = image[word] >> 8, next[1] = image[word];
    put(DATA, payload, sizeof payload);
}

static int serve(modbus_t *context, modbus_mapping_t *mapping, int peer)
{
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    modbus_set_socket(context, peer);
    int length = modbus_receive(context, query);
    if (length < 0)
        return 0;
    modbus_reply(context, query, length, mapping);
    if (length > 9 && query[7] == MODBUS_FC_WRITE_MULTIPLE_REGISTERS && (query[8] << 8 | query[9]) < LAST_INPUT)
        send_inputs();
    return 1;
}

int main(int argc, char **argv)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(argc > 1 ? atoi(argv[1]) : 30004)};
    struct pollfd watched[PEERS + 2];
    uint8_t payload[65536];
    int one = 1, count = 2, type;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    robot = socket(AF_INET, SOCK_STREAM, 0);
    if (connect(robot, (struct sockaddr *)&address, sizeof address))
        fail("connect");
    setsockopt(robot, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    modbus_mapping_t *mapping = modbus_mapping_new(0, 0, 1000, 0);
    image = mapping->tab_registers;
    set_up();
    modbus_t *context = modbus_new_tcp("127.0.0.1", argc > 2 ? atoi(argv[2]) : 1502);
    int listener = modbus_tcp_listen(context, PEERS);
    if (listener < 0)
        fail("listen");
    watched[0] = (struct pollfd){robot, POLLIN, 0};
    watched[1] = (struct pollfd){listener, POLLIN, 0};
    while (poll(watched, count, -1) > 0) {
        if (watched[0].revents && take(payload, &type) && type == DATA)
            show(payload + 1);
        for (int peer = count - 1; peer > 1; peer--)
            if (watched[peer].revents && !serve(context, mapping, watched[peer].fd)) {
                close(watched[peer].fd);
                watched[peer] = watched[--count];
            }
        if (watched[1].revents && count < PEERS + 2) {
            int accepted = accept(listener, NULL, NULL);
            setsockopt(accepted, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
            watched[count++] = (struct pollfd){accepted, POLLIN, 0};
        }
    }
}

/* libmodbus as a server of other people's, with units 1 to 3, or as many as wanted, on TCP or one unit on a serial line.
 * Usage: libmodbus_server tcp ADDRESS PORT [UNITS] | libmodbus_server rtu DEVICE BAUDRATE UNIT
 * Prints "listening" once it serves. A holding register that was never written reads as its address.
 * Build: cc -O2 -o libmodbus_server libmodbus_server.c -I/usr/include/modbus -lmodbus */
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/select.h>
#include <unistd.h>

#define MAX_UNITS 64
#define REGISTERS 2000

static modbus_mapping_t *new_unit(void)
{
    modbus_mapping_t *unit = modbus_mapping_new(REGISTERS, REGISTERS, REGISTERS, REGISTERS);
    for (int address = 0; unit != NULL && address < REGISTERS; address++)
        unit->tab_registers[address] = address;
    return unit;
}

static int fail(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, modbus_strerror(errno));
    return 1;
}

static void listening(void)
{
    puts("listening");
    fflush(stdout);
}

static int serve_line(const char *device, int baudrate, int number)
{
    modbus_t *context = modbus_new_rtu(device, baudrate, 'N', 8, 1);
    modbus_mapping_t *unit = new_unit();
    uint8_t query[MODBUS_RTU_MAX_ADU_LENGTH];

    if (context == NULL || unit == NULL || modbus_set_slave(context, number) || modbus_connect(context))
        return fail(device);
    listening();
    for (;;) {
        int length = modbus_receive(context, query);
        if (length > 0)
            modbus_reply(context, query, length, unit);
        else /* another unit's; or its answer did not come, and the rest of what was taken for it is left */
            modbus_flush(context);
    }
}

static int serve_tcp(const char *address, int port, int count)
{
    modbus_t *context = modbus_new_tcp(address, port);
    modbus_mapping_t *units[MAX_UNITS];
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    int listener = modbus_tcp_listen(context, 16), highest = listener;
    fd_set watched, ready;

    if (listener < 0)
        return fail("cannot listen");
    if (count > MAX_UNITS)
        count = MAX_UNITS;
    for (int number = 0; number < count; number++)
        units[number] = new_unit();
    FD_ZERO(&watched);
    FD_SET(listener, &watched);
    listening();
    for (;;) {
        ready = watched;
        if (select(highest + 1, &ready, NULL, NULL, NULL) < 0)
            return fail("select");
        for (int fd = 0; fd <= highest; fd++) {
            if (!FD_ISSET(fd, &ready))
                continue;
            if (fd == listener) {
                int accepted = modbus_tcp_accept(context, &listener);
                if (accepted >= 0) {
                    FD_SET(accepted, &watched);
                    highest = accepted > highest ? accepted : highest;
                }
                continue;
            }
            modbus_set_socket(context, fd);
            int length = modbus_receive(context, query);
            if (length < 0) {
                close(fd);
                FD_CLR(fd, &watched);
            } else if (length > 0 && query[6] >= 1 && query[6] <= count) {
                modbus_reply(context, query, length, units[query[6] - 1]);
            }
        }
    }
}

int main(int argc, char **argv)
{
    if ((argc == 4 || argc == 5) && strcmp(argv[1], "tcp") == 0)
        return serve_tcp(argv[2], atoi(argv[3]), argc == 5 ? atoi(argv[4]) : 3);
    if (argc == 5 && strcmp(argv[1], "rtu") == 0)
        return serve_line(argv[2], atoi(argv[3]), atoi(argv[4]));
    fprintf(stderr, "usage: libmodbus_server tcp ADDRESS PORT [UNITS] | rtu DEVICE BAUDRATE UNIT\n");
    return 2;
}

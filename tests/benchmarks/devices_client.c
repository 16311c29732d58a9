/* The yardstick: libmodbus's client, reading holding registers from address 0 on, one request after the other.
 * Usage: devices_client PORT REGISTERS SECONDS. Prints polls, seconds, CPU seconds.
 * Build: cc -O2 -o devices_client devices_client.c $(pkg-config --cflags --libs libmodbus) */
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <time.h>

static double wall(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + now.tv_nsec / 1e9;
}

static double cpu(void)
{
    struct rusage used;

    getrusage(RUSAGE_SELF, &used);
    return used.ru_utime.tv_sec + used.ru_stime.tv_sec + (used.ru_utime.tv_usec + used.ru_stime.tv_usec) / 1e6;
}

int main(int argc, char **argv)
{
    modbus_t *context = argc == 4 ? modbus_new_tcp("127.0.0.1", atoi(argv[1])) : NULL;
    uint16_t registers[MODBUS_MAX_READ_REGISTERS];
    long polls = 0;

    if (context == NULL || modbus_set_slave(context, 1) < 0 || modbus_connect(context) < 0)
        return 1;
    double start = wall(), used = cpu(), end = start + atof(argv[3]);
    while (wall() < end) {
        if (modbus_read_registers(context, 0, atoi(argv[2]), registers) < 0)
            return 1;
        polls++;
    }
    printf("%ld %f %f\n", polls, wall() - start, cpu() - used);
    return 0;
}

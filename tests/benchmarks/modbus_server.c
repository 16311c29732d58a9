/* The yardstick: libmodbus's own server loop over select(), as in its documentation, any number of connections.
 * Usage: modbus_server PORT. Build: cc -O2 -o modbus_server modbus_server.c $(pkg-config --cflags --libs libmodbus) */
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/select.h>
#include <unistd.h>

int main(int argc, char **argv)
{
    modbus_t *context = modbus_new_tcp("127.0.0.1", argc > 1 ? atoi(argv[1]) : 1502);
    modbus_mapping_t *mapping = modbus_mapping_new(2000, 2000, 1000, 1000);
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    int listener = modbus_tcp_listen(context, 64);
    int highest = listener;
    fd_set watched, ready;

    if (listener < 0 || mapping == NULL) {
        fprintf(stderr, "cannot listen: %s\n", modbus_strerror(errno));
        return 1;
    }
    FD_ZERO(&watched);
    FD_SET(listener, &watched);
    puts("listening");
    fflush(stdout);
    for (;;) {
        ready = watched;
        if (select(highest + 1, &ready, NULL, NULL, NULL) < 0)
            return 1;
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
            if (length > 0) {
                modbus_reply(context, query, length, mapping);
            } else if (length < 0) {
                close(fd);
                FD_CLR(fd, &watched);
            }
        }
    }
}

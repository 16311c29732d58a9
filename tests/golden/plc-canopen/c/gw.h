/* cell line-2: C */
/* Made by gatewayd export plc from line-2.yaml, fingerprint 4384caf0. */
/* Change the mapping and make this file anew, instead of changing it. */
/* gatewayd-checksum: 9eac1c9704afef62 */
/* The PLC is the writer plc, number 1. */
/* Left out: `hidden`: in no TPDO. */
/* CANopen node 16, 500000 bit/s; the objects are those of gatewayd export eds */
/* rpdo1: COB-ID 210h, 1 byte, event-driven */
/* rpdo2: COB-ID 310h, 8 bytes, event-driven */
/* rpdo3: COB-ID 410h, 4 bytes, event-driven */
/* tpdo1: COB-ID 190h, 8 bytes, event-driven */
/* tpdo2: COB-ID 290h, 8 bytes, event-driven */
/* tpdo3: COB-ID 390h, 8 bytes, event-driven */
/* tpdo4: COB-ID 490h, 6 bytes, event-driven */
/* tpdo5: COB-ID 1C0h, 1 byte, event-driven */
/* tpdo6: COB-ID 1C1h, 5 bytes, event-driven */
/* tpdo7: COB-ID 1C2h, 8 bytes, event-driven */
/* tpdo8: COB-ID 1C3h, 8 bytes, event-driven */
/* tpdo9: COB-ID 1C4h, 8 bytes, event-driven */
/* tpdo10: COB-ID 1C5h, 8 bytes, event-driven */
#ifndef GW_H
#define GW_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define GW_FINGERPRINT UINT32_C(0x4384CAF0)
#define GW_RPDO1_COB_ID 0x210
#define GW_RPDO2_COB_ID 0x310
#define GW_RPDO3_COB_ID 0x410
#define GW_TPDO1_COB_ID 0x190
#define GW_TPDO2_COB_ID 0x290
#define GW_TPDO3_COB_ID 0x390
#define GW_TPDO4_COB_ID 0x490
#define GW_TPDO5_COB_ID 0x1C0
#define GW_TPDO6_COB_ID 0x1C1
#define GW_TPDO7_COB_ID 0x1C2
#define GW_TPDO8_COB_ID 0x1C3
#define GW_TPDO9_COB_ID 0x1C4
#define GW_TPDO10_COB_ID 0x1C5

enum gw_quality { GW_QUALITY_GOOD, GW_QUALITY_STALE, GW_QUALITY_UNAVAILABLE, GW_QUALITY_NEVER, GW_QUALITY_FORCED, GW_QUALITY_DIFFERS, GW_QUALITY_OUT_OF_RANGE, GW_QUALITY_NOT_RUNNING, GW_QUALITY_UNKNOWN };

enum gw_robot { GW_ROBOT_LOST, GW_ROBOT_WAITING, GW_ROBOT_FRESH, GW_ROBOT_SILENT, GW_ROBOT_FROZEN, GW_ROBOT_LATE, GW_ROBOT_UNKNOWN };

enum gw_refusal { GW_REFUSAL_NONE, GW_REFUSAL_NO_SUCH_ADDRESS, GW_REFUSAL_NOT_WRITABLE, GW_REFUSAL_HELD, GW_REFUSAL_OUT_OF_LIMITS, GW_REFUSAL_PARTIAL_VALUE, GW_REFUSAL_ROBOT_LOST, GW_REFUSAL_CLAIMED_ELSEWHERE, GW_REFUSAL_HEARTBEAT_LOST, GW_REFUSAL_PARTIAL_TAKEOVER, GW_REFUSAL_WAITED, GW_REFUSAL_NOT_MEANT, GW_REFUSAL_CONTRADICTED, GW_REFUSAL_NOT_IN_ROLE, GW_REFUSAL_UNKNOWN };

enum gw_program { GW_PROGRAM_UNKNOWN, GW_PROGRAM_STOPPING, GW_PROGRAM_STOPPED, GW_PROGRAM_PLAYING, GW_PROGRAM_PAUSING, GW_PROGRAM_PAUSED, GW_PROGRAM_RESUMING, GW_PROGRAM_RETRACTING };

struct gw_inputs {
    bool start; /* RPDO 1 byte 0 bit 0 (2000h:01) bit: begin one cycle */
    bool toggle; /* RPDO 1 byte 0 bit 1 (2000h:02) bit */
    uint16_t part; /* RPDO 2 byte 0 (2070h:01) uint16, 0 to 999 */
    int32_t batch; /* RPDO 2 byte 2 (2010h:01) int32, pieces */
    double force; /* RPDO 2 byte 6 (2060h:01) int16 * 0.1, N, 0 to 150: größte Kraft (* der Presse *) */
    float speed; /* RPDO 3 byte 0 (2030h:01) float32, m/s */
};

struct gw_outputs {
    bool ready; /* TPDO 5 byte 0 bit 0 (2400h:01) bit */
    bool fault; /* TPDO 5 byte 0 bit 1 (2400h:02) bit */
    int8_t gripper; /* TPDO 6 byte 0 (2480h:01) int8 */
    uint32_t cycles; /* TPDO 6 byte 1 (2440h:01) uint32 */
    double width; /* TPDO 4 byte 4 (2470h:01) uint16 * 0.01 + -10, mm */
    double energy; /* TPDO 7 byte 0 (2420h:01) float64, J */
    float pose[6]; /* TPDO 8 byte 0 (2430h:01) to TPDO 10 byte 4 (2430h:06) float32, m and rad */
};

struct gw_from_node {
    uint8_t tpdo1[8]; /* tpdo1: COB-ID 190h, 8 bytes, event-driven */
    uint8_t tpdo2[8]; /* tpdo2: COB-ID 290h, 8 bytes, event-driven */
    uint8_t tpdo3[8]; /* tpdo3: COB-ID 390h, 8 bytes, event-driven */
    uint8_t tpdo4[6]; /* tpdo4: COB-ID 490h, 6 bytes, event-driven */
    uint8_t tpdo5[1]; /* tpdo5: COB-ID 1C0h, 1 byte, event-driven */
    uint8_t tpdo6[5]; /* tpdo6: COB-ID 1C1h, 5 bytes, event-driven */
    uint8_t tpdo7[8]; /* tpdo7: COB-ID 1C2h, 8 bytes, event-driven */
    uint8_t tpdo8[8]; /* tpdo8: COB-ID 1C3h, 8 bytes, event-driven */
    uint8_t tpdo9[8]; /* tpdo9: COB-ID 1C4h, 8 bytes, event-driven */
    uint8_t tpdo10[8]; /* tpdo10: COB-ID 1C5h, 8 bytes, event-driven */
};

struct gw_to_node {
    uint8_t rpdo1[1]; /* rpdo1: COB-ID 210h, 1 byte, event-driven */
    uint8_t rpdo2[8]; /* rpdo2: COB-ID 310h, 8 bytes, event-driven */
    uint8_t rpdo3[4]; /* rpdo3: COB-ID 410h, 4 bytes, event-driven */
};

struct gw_status {
    uint16_t status_flags; /* flags of the status */
    uint16_t status_heartbeat; /* heartbeat of the status */
    uint32_t status_fingerprint; /* fingerprint of the status */
    uint16_t status_robot_state; /* robot_state of the status */
    uint16_t status_program; /* program of the status */
    uint16_t status_refusal_reason; /* refusal_reason of the status */
    uint16_t status_refusal_variable; /* refusal_variable of the status */
    uint32_t status_robot_age; /* robot_age of the status */
    uint32_t status_refused; /* refused of the status */
    uint16_t quality_11; /* quality of width */
    uint16_t quality_7; /* quality of ready */
};

static inline uint64_t gw_get(const uint8_t *byte, int count)
{
    uint64_t number = 0;
    for (int i = count - 1; i >= 0; i--)
        number = number << 8 | byte[i];
    return number;
}

static inline void gw_put(uint8_t *byte, int count, uint64_t number)
{
    for (int i = 0; i < count; i++, number >>= 8)
        byte[i] = (uint8_t)number;
}

static inline float gw_float(uint64_t bits)
{
    uint32_t low = (uint32_t)bits;
    float number;
    memcpy(&number, &low, sizeof number);
    return number;
}

static inline double gw_double(uint64_t bits)
{
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

static inline uint64_t gw_float_bits(double wide)
{
    float number = isfinite(wide) && fabs(wide) > FLT_MAX ? (float)copysign(FLT_MAX, wide) : (float)wide;
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

static inline uint64_t gw_double_bits(double number)
{
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

/* The nearest whole number, halves to even; what lies beyond low and high is these, NaN is 0. */
static inline int64_t gw_nearest(double raw, int64_t low, int64_t high)
{
    return isnan(raw) ? 0 : raw <= (double)low ? low : raw >= (double)high ? high : (int64_t)rint(raw);
}

static inline uint64_t gw_nearest_unsigned(double raw, uint64_t high)
{
    return isnan(raw) || raw <= 0 ? 0 : raw >= (double)high ? high : (uint64_t)rint(raw);
}

static inline void gw_unpack(const struct gw_from_node *from_node, struct gw_outputs *outputs)
{
    outputs->ready = (from_node->tpdo5[0] >> 0 & 1) != 0;
    outputs->fault = (from_node->tpdo5[0] >> 1 & 1) != 0;
    outputs->gripper = (int8_t)gw_get(from_node->tpdo6 + 0, 1);
    outputs->cycles = (uint32_t)gw_get(from_node->tpdo6 + 1, 4);
    outputs->width = (uint16_t)gw_get(from_node->tpdo4 + 4, 2) * (0.01) + (-10.0);
    outputs->energy = gw_double(gw_get(from_node->tpdo7 + 0, 8));
    outputs->pose[0] = gw_float(gw_get(from_node->tpdo8 + 0, 4));
    outputs->pose[1] = gw_float(gw_get(from_node->tpdo8 + 4, 4));
    outputs->pose[2] = gw_float(gw_get(from_node->tpdo9 + 0, 4));
    outputs->pose[3] = gw_float(gw_get(from_node->tpdo9 + 4, 4));
    outputs->pose[4] = gw_float(gw_get(from_node->tpdo10 + 0, 4));
    outputs->pose[5] = gw_float(gw_get(from_node->tpdo10 + 4, 4));
}

static inline void gw_pack(const struct gw_inputs *inputs, struct gw_to_node *to_node)
{
    to_node->rpdo1[0] = (uint8_t)(inputs->start << 0 | inputs->toggle << 1);
    gw_put(to_node->rpdo2 + 0, 2, (uint64_t)inputs->part);
    gw_put(to_node->rpdo2 + 2, 4, (uint64_t)inputs->batch);
    gw_put(to_node->rpdo2 + 6, 2, (uint64_t)gw_nearest((inputs->force - (0.0)) / (0.1), INT64_C(-32768), INT64_C(32767)));
    gw_put(to_node->rpdo3 + 0, 4, gw_float_bits(inputs->speed));
}

static inline void gw_decode_status(const struct gw_from_node *from_node, struct gw_status *status)
{
    status->status_flags = (uint16_t)gw_get(from_node->tpdo1 + 0, 2);
    status->status_heartbeat = (uint16_t)gw_get(from_node->tpdo1 + 2, 2);
    status->status_fingerprint = (uint32_t)gw_get(from_node->tpdo1 + 4, 4);
    status->status_robot_state = (uint16_t)gw_get(from_node->tpdo2 + 0, 2);
    status->status_program = (uint16_t)gw_get(from_node->tpdo2 + 2, 2);
    status->status_refusal_reason = (uint16_t)gw_get(from_node->tpdo2 + 4, 2);
    status->status_refusal_variable = (uint16_t)gw_get(from_node->tpdo2 + 6, 2);
    status->status_robot_age = (uint32_t)gw_get(from_node->tpdo3 + 0, 4);
    status->status_refused = (uint32_t)gw_get(from_node->tpdo3 + 4, 4);
    status->quality_11 = (uint16_t)gw_get(from_node->tpdo4 + 0, 2);
    status->quality_7 = (uint16_t)gw_get(from_node->tpdo4 + 2, 2);
}

#endif

/* cell press-3: C */
/* Made by gatewayd export plc from press-3.yaml, fingerprint 2ebc1268. */
/* Change the mapping and make this file anew, instead of changing it. */
/* gatewayd-checksum: 54a55eede5e88077 */
/* The PLC is the writer plc, number 1. */
/* Left out: `jog`: not written by this PLC. */
/* Modbus TCP 127.0.0.1:1502, unit 1 */
/* status1: FC 3, address 60000 (460001), count 66, every round: header, one bit for each good variable */
/* status2: FC 3, address 63264 (463265), count 26, in turns: quality of each variable */
/* status3: FC 3, address 60192 (460193), count 26, in turns: owner of each variable */
/* read1: FC 3, address 100 (400101), count 5, every round: from the robot */
/* read2: FC 3, address 106 (400107), count 2, every round: from the robot */
/* read3: FC 3, address 110 (400111), count 12, every round: from the robot */
/* read4: FC 2, address 3 (100004), count 1, every round: from the robot */
/* write1: FC 16, address 0 (400001), count 7, every round: to the robot */
/* write2: FC 16, address 20 (400021), count 2, on demand: on demand: others may hold it */
/* write3: FC 16, address 22 (400023), count 2, on demand: on demand: others may hold it */
/* write4: FC 16, address 24 (400025), count 2, on demand: on demand: others may hold it */
/* write5: FC 15, address 7 (000008), count 1, every round: to the robot */
#ifndef GW_H
#define GW_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define GW_FINGERPRINT UINT32_C(0x2EBC1268)

enum gw_quality { GW_QUALITY_GOOD, GW_QUALITY_STALE, GW_QUALITY_UNAVAILABLE, GW_QUALITY_NEVER, GW_QUALITY_FORCED, GW_QUALITY_DIFFERS, GW_QUALITY_OUT_OF_RANGE, GW_QUALITY_NOT_RUNNING, GW_QUALITY_UNKNOWN };

enum gw_robot { GW_ROBOT_LOST, GW_ROBOT_WAITING, GW_ROBOT_FRESH, GW_ROBOT_SILENT, GW_ROBOT_FROZEN, GW_ROBOT_LATE, GW_ROBOT_UNKNOWN };

enum gw_refusal { GW_REFUSAL_NONE, GW_REFUSAL_NO_SUCH_ADDRESS, GW_REFUSAL_NOT_WRITABLE, GW_REFUSAL_HELD, GW_REFUSAL_OUT_OF_LIMITS, GW_REFUSAL_PARTIAL_VALUE, GW_REFUSAL_ROBOT_LOST, GW_REFUSAL_CLAIMED_ELSEWHERE, GW_REFUSAL_HEARTBEAT_LOST, GW_REFUSAL_PARTIAL_TAKEOVER, GW_REFUSAL_WAITED, GW_REFUSAL_NOT_MEANT, GW_REFUSAL_CONTRADICTED, GW_REFUSAL_NOT_IN_ROLE, GW_REFUSAL_UNKNOWN };

enum gw_program { GW_PROGRAM_UNKNOWN, GW_PROGRAM_STOPPING, GW_PROGRAM_STOPPED, GW_PROGRAM_PLAYING, GW_PROGRAM_PAUSING, GW_PROGRAM_PAUSED, GW_PROGRAM_RESUMING, GW_PROGRAM_RETRACTING };

struct gw_inputs {
    bool start; /* 400001.0 (0.0) bit: begin one cycle */
    bool toggle; /* 400001.1 (0.1) bit */
    uint16_t part; /* 400002 (1) uint16 ABCD, 0 to 999 */
    int32_t batch; /* 400003 (2) int32 CDAB, pieces */
    double force; /* 400005 (4) int16 ABCD * 0.1, N, 0 to 150: größte Kraft (* der Presse *) */
    float speed; /* 400006 (5) float32 DCBA, m/s */
    float offsets[3]; /* 400021 (20) to 400025 (24) float32 ABCD, m */
    bool lamp; /* 000008 (7) bit */
};

struct gw_outputs {
    bool ready; /* 400101.0 (100.0) bit */
    bool fault; /* 400101.1 (100.1) bit */
    bool ack; /* 400101.2 (100.2) bit */
    int8_t gripper; /* 400102.high (101.high) int8 ABCD */
    uint8_t tool; /* 400102.low (101.low) uint8 ABCD */
    uint32_t cycles; /* 400103 (102) uint32 BADC */
    double width; /* 400105 (104) uint16 ABCD * 0.01 + -10, mm */
    double energy; /* 400107 (106) int32 ABCD * 0.5, J */
    float pose[6]; /* 400111 (110) to 400121 (120) float32 CDAB, m and rad */
    bool door; /* 100004 (3) bit */
};

struct gw_image {
    uint16_t status1[66]; /* header, one bit for each good variable */
    uint16_t status2[26]; /* quality of each variable */
    uint16_t status3[26]; /* owner of each variable */
    uint16_t read1[5]; /* from the robot */
    uint16_t read2[2]; /* from the robot */
    uint16_t read3[12]; /* from the robot */
    bool read4[1]; /* from the robot */
    uint16_t write1[7]; /* to the robot */
    uint16_t write2[2]; /* on demand: others may hold it */
    uint16_t write3[2]; /* on demand: others may hold it */
    uint16_t write4[2]; /* on demand: others may hold it */
    bool write5[1]; /* to the robot */
};

static inline uint64_t gw_get(const uint16_t *word, int count, int reversed, int swapped)
{
    uint64_t number = 0;
    for (int i = 0; i < count; i++) {
        uint16_t each = word[reversed ? count - 1 - i : i];
        number = number << 16 | (swapped ? (uint16_t)(each << 8 | each >> 8) : each);
    }
    return number;
}

static inline void gw_put(uint16_t *word, int count, int reversed, int swapped, uint64_t number)
{
    for (int i = count - 1; i >= 0; i--, number >>= 16) {
        uint16_t each = (uint16_t)number;
        word[reversed ? count - 1 - i : i] = swapped ? (uint16_t)(each << 8 | each >> 8) : each;
    }
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

static inline void gw_unpack(const struct gw_image *image, struct gw_outputs *outputs)
{
    outputs->ready = (image->read1[0] >> 0 & 1) != 0;
    outputs->fault = (image->read1[0] >> 1 & 1) != 0;
    outputs->ack = (image->read1[0] >> 2 & 1) != 0;
    outputs->gripper = (int8_t)(gw_get(image->read1 + 1, 1, 0, 0) >> 8);
    outputs->tool = (uint8_t)(gw_get(image->read1 + 1, 1, 0, 0) >> 0);
    outputs->cycles = (uint32_t)gw_get(image->read1 + 2, 2, 0, 1);
    outputs->width = (uint16_t)gw_get(image->read1 + 4, 1, 0, 0) * (0.01) + (-10.0);
    outputs->energy = (int32_t)gw_get(image->read2 + 0, 2, 0, 0) * (0.5) + (0.0);
    outputs->pose[0] = gw_float(gw_get(image->read3 + 0, 2, 1, 0));
    outputs->pose[1] = gw_float(gw_get(image->read3 + 2, 2, 1, 0));
    outputs->pose[2] = gw_float(gw_get(image->read3 + 4, 2, 1, 0));
    outputs->pose[3] = gw_float(gw_get(image->read3 + 6, 2, 1, 0));
    outputs->pose[4] = gw_float(gw_get(image->read3 + 8, 2, 1, 0));
    outputs->pose[5] = gw_float(gw_get(image->read3 + 10, 2, 1, 0));
    outputs->door = image->read4[0];
}

static inline void gw_pack(const struct gw_inputs *inputs, struct gw_image *image)
{
    image->write1[0] = (uint16_t)(inputs->start << 0);
    image->write1[0] |= (uint16_t)(inputs->toggle << 1);
    gw_put(image->write1 + 1, 1, 0, 0, (uint64_t)inputs->part);
    gw_put(image->write1 + 2, 2, 1, 0, (uint64_t)inputs->batch);
    gw_put(image->write1 + 4, 1, 0, 0, (uint64_t)gw_nearest((inputs->force - (0.0)) / (0.1), INT64_C(-32768), INT64_C(32767)));
    gw_put(image->write1 + 5, 2, 1, 1, gw_float_bits(inputs->speed));
    gw_put(image->write2 + 0, 2, 0, 0, gw_float_bits(inputs->offsets[0]));
    gw_put(image->write3 + 0, 2, 0, 0, gw_float_bits(inputs->offsets[1]));
    gw_put(image->write4 + 0, 2, 0, 0, gw_float_bits(inputs->offsets[2]));
    image->write5[0] = inputs->lamp;
}

#endif

/* An FMU of FMI 3 for tests: clocks of each kind, and arrays whose length is a structural parameter. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { OK, WARNING, DISCARD, ERROR };
enum { N = 1, FACTOR, U, Y, PUSH, AMOUNT, TOTAL, SAMPLE, SAMPLED, DELAY, LATE, THIRDS, FULL, OVERFLOWS, WORDS, PULSE, PACED };
enum { MOST = 8 };

typedef struct {
    uint64_t n;
    double factor, u[MOST], amount, total, sampled, countdown, pulse;
    int32_t late, thirds, overflows;
    bool push, sample, delay, third, full, pulsed, configuring, starting, events;
} Model;

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *path, bool visible, bool logging,
                                  bool events, bool early, const uint32_t *required, size_t n, void *environment,
                                  void *log, void *update) {
    Model *m = calloc(1, sizeof(Model));
    m->n = 3;
    m->factor = 1;
    m->countdown = -1;
    return m;
}
int fmi3EnterConfigurationMode(Model *m) { m->configuring = true; return OK; }
int fmi3ExitConfigurationMode(Model *m) { m->configuring = false; return OK; }
int fmi3EnterInitializationMode(Model *m, bool t, double tolerance, double start, bool s, double stop) {
    m->starting = m->pulsed = true;
    return OK;
}
int fmi3ExitInitializationMode(Model *m) { m->starting = m->pulsed = false, m->events = true; return OK; }
int fmi3EnterEventMode(Model *m) { m->events = true; return OK; }
int fmi3EnterStepMode(Model *m) { m->events = false; return OK; }
int fmi3SetClock(Model *m, const uint32_t *vr, size_t n, const bool *v) {
    for (size_t i = 0; i < n; i++) {
        if (!m->events) return ERROR;
        if (vr[i] == PUSH) m->push = v[i];
        if (vr[i] == SAMPLE) m->sample = v[i], m->sampled = m->u[0];
        if (vr[i] == DELAY) m->delay = v[i], m->late++;
        if (vr[i] == THIRDS) m->third = v[i], m->thirds++;
        if (vr[i] == PULSE) m->pulsed = v[i];
    }
    return OK;
}
int fmi3GetClock(Model *m, const uint32_t *vr, size_t n, bool *v) {
    v[0] = m->full;
    return m->events ? OK : ERROR;
}
/* A push adds the amount and starts a countdown; a total above 10 overflows in a second round of the same event. */
int fmi3UpdateDiscreteStates(Model *m, bool *again, bool *ends, bool *nominals, bool *values, bool *defined,
                             double *next) {
    if (m->full) m->overflows++, m->total = 0;
    if (m->push) m->countdown = 0.4;
    *again = !m->full && m->total > 10;
    m->full = *again;
    m->push = m->sample = m->delay = m->third = false;
    *ends = *nominals = *values = *defined = false;
    return OK;
}
/* A clock's interval is new when it has ticked, or another event says so; that of a fixed clock only at the start. */
int fmi3GetIntervalDecimal(Model *m, const uint32_t *vr, size_t n, double *interval, int *qualifier) {
    if (vr[0] == PACED) {
        *qualifier = m->starting ? 2 : 1;
        *interval = m->factor;
        return OK;
    }
    if (vr[0] == PULSE) {
        *qualifier = m->pulsed ? 2 : 1;
        *interval = m->pulse = m->pulsed ? 2 * m->pulse + 0.1 : m->pulse;
        m->pulsed = false;
        return OK;
    }
    if (vr[0] != DELAY) return ERROR;
    *qualifier = m->countdown < 0 ? 1 : 2;
    *interval = m->countdown;
    m->countdown = -1;
    return OK;
}
int fmi3GetShiftDecimal(Model *m, const uint32_t *vr, size_t n, double *shift) {
    *shift = 0.5;
    return m->starting && vr[0] == PACED ? OK : ERROR;
}
int fmi3DoStep(Model *m, double t, double h, bool no, bool *event, bool *ends, bool *early, double *last) {
    *event = *ends = *early = false;
    *last = t + h;
    return OK;
}
int fmi3GetFloat64(Model *m, const uint32_t *vr, size_t n, double *v, size_t nv) {
    if (vr[0] == Y) {
        if (nv != 2 * m->n) return ERROR;
        for (size_t i = 0; i < m->n; i++) v[i] = m->factor * m->u[i], v[m->n + i] = -v[i];
    } else if (vr[0] == TOTAL) {
        if (!m->push) return ERROR; /* which is there only while its clock ticks */
        v[0] = m->total;
    } else
        v[0] = vr[0] == SAMPLED ? m->sampled : m->factor;
    return OK;
}
int fmi3SetFloat64(Model *m, const uint32_t *vr, size_t n, const double *v, size_t nv) {
    if (vr[0] == FACTOR) m->factor = v[0];
    if (vr[0] == AMOUNT) {
        if (!m->push) return ERROR;
        m->amount = v[0];
        m->total += v[0];
    }
    if (vr[0] == U) {
        if (nv != m->n) return ERROR;
        memcpy(m->u, v, nv * sizeof(double));
    }
    return OK;
}
int fmi3GetInt32(Model *m, const uint32_t *vr, size_t n, int32_t *v, size_t nv) {
    v[0] = vr[0] == LATE ? m->late : vr[0] == THIRDS ? m->thirds : m->overflows;
    return OK;
}
int fmi3GetString(Model *m, const uint32_t *vr, size_t n, const char **v, size_t nv) {
    v[0] = "one";
    v[1] = "two";
    return OK;
}
int fmi3SetUInt64(Model *m, const uint32_t *vr, size_t n, const uint64_t *v, size_t nv) {
    m->n = v[0];
    return m->configuring && v[0] <= MOST ? OK : ERROR;
}
#include "state.h"

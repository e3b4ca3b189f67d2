/* An FMU of FMI 3 for tests: a stair, a vessel that fills with what flows in, and a feedthrough; and mistakes. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct {
    double time, level, flow, period, next, in;
    int32_t counter, fills, mistake;
    bool full, event;
} Model;
enum { OK, WARNING, DISCARD, ERROR };
enum { PERIOD = 1, FLOW, IN, OUT, LEVEL, COUNTER, FILLS, FULL, MISTAKE };

const char *fmi3GetVersion(void) { return "3.0"; }

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *path, bool visible, bool logging,
                                  bool events, bool early, const uint32_t *required, size_t n, void *environment,
                                  void *log, void *update) {
    Model *m = calloc(1, sizeof(Model));
    m->period = 1.0;
    return m;
}
int fmi3EnterInitializationMode(Model *m, bool t, double tolerance, double start, bool s, double stop) {
    m->time = start;
    m->next = start + m->period;
    return OK;
}
int fmi3ExitInitializationMode(Model *m) { return OK; }
int fmi3EnterEventMode(Model *m) { return OK; }
int fmi3EnterStepMode(Model *m) { return OK; }
int fmi3UpdateDiscreteStates(Model *m, bool *again, bool *ends, bool *nominals, bool *values, bool *defined,
                             double *next) {
    if (m->time >= m->next - 1e-12) {
        m->counter += 1;
        m->next += m->period;
    }
    if (m->full) {
        m->full = false;
        m->fills += 1;
        m->level = 0;
    }
    *again = *nominals = *values = false;
    *ends = m->counter >= 10;
    *defined = true;
    *next = m->next;
    return OK;
}
int fmi3DoStep(Model *m, double t, double h, bool no, bool *event, bool *ends, bool *early, double *last) {
    double end = t + h;
    *event = *ends = *early = false;
    if (m->mistake == 1) abort();
    if (m->mistake == 2) sleep(600);
    if (m->mistake == 3) return ERROR;
    if (m->flow > 0 && t + (1 - m->level) / m->flow <= end) {
        end = t + (1 - m->level) / m->flow;
        *event = *early = m->full = true;
        m->level = 1;
    } else
        m->level += m->flow * h;
    m->time = *last = end;
    return OK;
}
int fmi3GetFloat64(Model *m, const uint32_t *vr, size_t n, double *v, size_t nv) {
    double all[] = {0, m->period, m->flow, m->in, m->mistake == 4 ? 0.0 / 0.0 : m->in, m->level};
    v[0] = all[vr[0]];
    return OK;
}
int fmi3SetFloat64(Model *m, const uint32_t *vr, size_t n, const double *v, size_t nv) {
    if (vr[0] == PERIOD) m->period = v[0];
    if (vr[0] == FLOW) m->flow = v[0];
    if (vr[0] == IN) m->in = v[0];
    return OK;
}
int fmi3GetInt32(Model *m, const uint32_t *vr, size_t n, int32_t *v, size_t nv) {
    v[0] = vr[0] == COUNTER ? m->counter : vr[0] == FILLS ? m->fills : m->mistake;
    return OK;
}
int fmi3SetInt32(Model *m, const uint32_t *vr, size_t n, const int32_t *v, size_t nv) {
    m->mistake = v[0];
    return OK;
}
int fmi3GetClock(Model *m, const uint32_t *vr, size_t n, bool *v) {
    v[0] = m->full;
    return OK;
}
#include "state.h"

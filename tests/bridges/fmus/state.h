/* The state and the end of an FMU, whose Model is all that it knows: included behind everything else. */
int fmi3GetFMUState(Model *m, void **state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, m, sizeof(Model));
    return OK;
}
int fmi3SetFMUState(Model *m, void *state) {
    memcpy(m, state, sizeof(Model));
    return OK;
}
int fmi3FreeFMUState(Model *m, void **state) {
    free(*state);
    *state = NULL;
    return OK;
}
int fmi3Terminate(Model *m) { return OK; }
void fmi3FreeInstance(Model *m) { free(m); }

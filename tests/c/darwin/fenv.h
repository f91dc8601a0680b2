#pragma once
typedef struct {
    unsigned long long __fpsr, __fpcr;
} fenv_t;
extern const fenv_t _FE_DFL_ENV;
#define FE_DFL_ENV &_FE_DFL_ENV
int fegetenv(fenv_t *);
int fesetenv(const fenv_t *);

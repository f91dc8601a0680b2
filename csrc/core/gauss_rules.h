/* Gauss' rules of measures that are given by many points. */
#ifndef MOIT_GAUSS_RULES_H
#define MOIT_GAUSS_RULES_H

enum { MOIT_MOST_RULE_POINTS = 48, MOIT_MOST_MEASURE_POINTS = 192 };

/* Legendre's rule over [-1, 1], of `count` points in increasing order: Gauss' own. */
void moit_legendre_rule(int count, double *point, double *weight);

/* The rule of `count` points whose integrals of polynomials up to degree 2 count - 1 are the sums
 * over the given `points`, at least twice as many, which lie in [-1, 1]. Points increase; weights
 * are above 0 and have the sum 1. Returns how many there are: fewer where the measure has fewer
 * points that weigh anything, 0 where it has none. */
int moit_gauss_rule(int points, const double *at, const double *mass, int count, double *point,
                    double *weight);

#endif

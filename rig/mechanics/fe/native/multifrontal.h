/* Multifrontal factorisation of sparse symmetric matrices (Duff & Reid, ACM Trans. Math. Softw. 9
 * (1983) 302): every front is a dense block whose pivots are eliminated at once, and whose Schur
 * complement goes to its parent. Fronts that do not depend on each other, and the blocks of large
 * ones, are shared among threads; sums are made in one order whatever the threads do, so that the
 * same matrix gives the same bytes.
 *
 * "Positions" number the unknowns in the order of elimination. Dense blocks go column by column.
 */
#ifndef RIG_MULTIFRONTAL_H
#define RIG_MULTIFRONTAL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { MULTIFRONTAL_DONE = 0, MULTIFRONTAL_SINGULAR = 1, MULTIFRONTAL_NO_MEMORY = 2 };

/* BLAS and LAPACK routines with Fortran's calling convention and 32-bit integers. */
typedef struct {
  void *dpotrf, *dsytrf, *dsytrs, *dtrsm, *dsyrk, *dgemm;
} multifrontal_blas;

/* The elimination tree of fronts, children before parents. */
typedef struct {
  int32_t fronts;
  int32_t size;             /* unknowns */
  const int32_t *pivot;     /* fronts + 1: first position eliminated in each */
  const int64_t *row_start; /* fronts + 1: where each one's other rows start in `row` */
  const int32_t *row;       /* their positions, ascending */
  const int32_t *parent;    /* -1 for a root */
  const int64_t *panel;     /* fronts + 1: where each one's factor starts */
} multifrontal_tree;

/* Factors of the symmetric matrix of compressed columns `start`, `index`, `data`, whose rows and
 * columns have the given `position`. `factor` takes panel[fronts] numbers: per front the factored
 * pivots on top of the rows below. `pivoting` (size) takes the pivots of Bunch & Kaufman of fronts
 * that are not positive definite, and `indefinite` (fronts) tells which are. */
int multifrontal_factorise(const multifrontal_tree *tree, const multifrontal_blas *blas,
                           int32_t threads, const int32_t *position, const int32_t *column,
                           const int32_t *start, const int32_t *index, const double *data,
                           double *factor, int32_t *pivoting, uint8_t *indefinite);

/* Solves for `columns` right hand sides of `size` numbers each, by position, in place. */
int multifrontal_solve(const multifrontal_tree *tree, const multifrontal_blas *blas,
                       const double *factor, const int32_t *pivoting, const uint8_t *indefinite,
                       int32_t columns, double *right);

#ifdef __cplusplus
}
#endif

#endif

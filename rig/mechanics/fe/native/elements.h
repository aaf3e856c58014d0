/* Kernels over many elements at once that would cost numpy several passes through memory. */
#ifndef RIG_ELEMENTS_H
#define RIG_ELEMENTS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { ELEMENTS_MAX_NODES = 32 };

/* What the element matrices of a chunk of elements are made of; arrays by rows. */
typedef struct {
  int32_t elements, points, nodes, dim, modes;
  int32_t entries[3];        /* entries of F that each displacement component moves */
  int32_t entry[9];          /* those entries, 0 to 8, component by component, three places each */
  const double *gradient[3]; /* per component (elements, points, entries, nodes) */
  const double *weight;      /* (elements, points) */
  const double *slope;       /* dP/dF: (9, 9, elements, points), symmetric */
  const double *left;        /* (elements, nodes * dim, modes), and */
  const double *right;       /* (elements, modes, nodes * dim): dyads to add, symmetric in sum */
} element_matrices;

/* The element matrices K = sum over points of B^T (weight slope) B + left right, with B the gradients, into `out`,
 * whose elements are `element_stride` and rows `row_stride` numbers apart. Elements have 6, 9, 10 or
 * 27 nodes; 0 for others, or where memory is short, and 1 otherwise. */
int elements_stiffness(const element_matrices *given, double *out, int64_t element_stride,
                       int64_t row_stride);

/* Add element matrices (elements, nodes * width, nodes * width) to the data of compressed columns.
 * The first entry of the block of two nodes goes to base (elements, nodes, nodes); columns of that
 * block are `stride` (elements, nodes; by the column's node) numbers apart. */
void elements_scatter(int32_t elements, int32_t nodes, int32_t width, const int32_t *base,
                      const int32_t *stride, const double *matrices, double *data);

#ifdef __cplusplus
}
#endif

#endif

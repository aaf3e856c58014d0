#include "multifrontal.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <queue>
#include <system_error>
#include <thread>
#include <vector>

namespace {

/* Rows or columns of a large front that one task handles; fixed, so that threads change nothing. */
constexpr int kBlock = 128;
/* Work (multiplications) below which a front is not worth sharing. */
constexpr double kWorthSharing = 4e6;

using Potrf = void (*)(const char *, const int *, double *, const int *, int *);
using Sytrf = void (*)(const char *, const int *, double *, const int *, int *, double *,
                       const int *, int *);
using Sytrs = void (*)(const char *, const int *, const int *, const double *, const int *,
                       const int *, double *, const int *, int *);
using Trsm = void (*)(const char *, const char *, const char *, const char *, const int *,
                      const int *, const double *, const double *, const int *, double *,
                      const int *);
using Syrk = void (*)(const char *, const char *, const int *, const int *, const double *,
                      const double *, const int *, const double *, double *, const int *);
using Gemm = void (*)(const char *, const char *, const int *, const int *, const int *,
                      const double *, const double *, const int *, const double *, const int *,
                      const double *, double *, const int *);

constexpr double kOne = 1.0, kMinusOne = -1.0, kZero = 0.0;

/* The dense routines, with the arguments that never change filled in. */
class Dense {
 public:
  explicit Dense(const multifrontal_blas &blas)
      : potrf_(reinterpret_cast<Potrf>(blas.dpotrf)),
        sytrf_(reinterpret_cast<Sytrf>(blas.dsytrf)),
        sytrs_(reinterpret_cast<Sytrs>(blas.dsytrs)),
        trsm_(reinterpret_cast<Trsm>(blas.dtrsm)),
        syrk_(reinterpret_cast<Syrk>(blas.dsyrk)),
        gemm_(reinterpret_cast<Gemm>(blas.dgemm)) {}

  /* a = L L^T in place; false where it is not positive definite. */
  bool cholesky(int n, double *a, int lda) const {
    int info = 0;
    potrf_("L", &n, a, &lda, &info);
    return info == 0;
  }

  /* a = L D L^T in place with pivots; false where it is singular. */
  bool pivoted(int n, double *a, int lda, int *pivots) const {
    int info = 0;
    std::vector<double> work(static_cast<size_t>(n) * 32);
    const int length = static_cast<int>(work.size());
    sytrf_("L", &n, a, &lda, pivots, work.data(), &length, &info);
    return info == 0;
  }

  /* b = a^-1 b by the factors of `pivoted`. */
  void pivoted_solve(int n, int columns, const double *a, int lda, const int *pivots, double *b,
                     int ldb) const {
    int info = 0;
    sytrs_("L", &n, &columns, a, &lda, pivots, b, &ldb, &info);
  }

  /* b = b L^-T for rows of b. */
  void divide_right(int rows, int n, const double *l, int ldl, double *b, int ldb) const {
    trsm_("R", "L", "T", "N", &rows, &n, &kOne, l, &ldl, b, &ldb);
  }

  /* b = L^-1 b, or L^-T b where transposed. */
  void divide_left(bool transposed, int n, int columns, const double *l, int ldl, double *b,
                   int ldb) const {
    trsm_("L", "L", transposed ? "T" : "N", "N", &n, &columns, &kOne, l, &ldl, b, &ldb);
  }

  /* c -= a a^T, lower triangle. */
  void subtract_square(int n, int k, const double *a, int lda, double *c, int ldc) const {
    syrk_("L", "N", &n, &k, &kMinusOne, a, &lda, &kOne, c, &ldc);
  }

  /* c -= op(a) op(b). */
  void subtract_product(const char *op_a, const char *op_b, int m, int n, int k, const double *a,
                        int lda, const double *b, int ldb, double *c, int ldc) const {
    gemm_(op_a, op_b, &m, &n, &k, &kMinusOne, a, &lda, b, &ldb, &kOne, c, &ldc);
  }

  /* c = op(a) b. */
  void product(const char *op_a, int m, int n, int k, const double *a, int lda, const double *b,
               int ldb, double *c, int ldc) const {
    gemm_(op_a, "N", &m, &n, &k, &kOne, a, &lda, b, &ldb, &kZero, c, &ldc);
  }

 private:
  Potrf potrf_;
  Sytrf sytrf_;
  Sytrs sytrs_;
  Trsm trsm_;
  Syrk syrk_;
  Gemm gemm_;
};

/* Memory that is given back and taken again: touching new pages costs as much as the numbers. */
class Pool {
 public:
  using Block = std::unique_ptr<double[]>;

  Block take(size_t numbers) {
    const size_t kind = kind_of(numbers);
    {
      std::lock_guard<std::mutex> lock(mutex_);
      std::vector<Block> &spare = spare_[kind];
      if (!spare.empty()) {
        Block block = std::move(spare.back());
        spare.pop_back();
        return block;
      }
    }
    return Block(new double[size_t{1} << kind]);
  }

  void give(Block block, size_t numbers) {
    std::lock_guard<std::mutex> lock(mutex_);
    spare_[kind_of(numbers)].push_back(std::move(block));
  }

 private:
  static size_t kind_of(size_t numbers) {
    size_t kind = 0;
    while ((size_t{1} << kind) < numbers) ++kind;
    return kind;
  }

  std::mutex mutex_;
  std::vector<Block> spare_[48];
};

/* What is to be done next; of a large front its panel and update are done block by block. */
struct Task {
  enum Stage { kAssemble, kPanel, kUpdate };
  Stage stage;
  int front;
  int block;
};

/* Blocks of fronts begun go first; then fronts in their order, which keeps memory low. */
struct Later {
  bool operator()(const Task &a, const Task &b) const {
    const bool begun_a = a.stage != Task::kAssemble, begun_b = b.stage != Task::kAssemble;
    if (begun_a != begun_b) return begun_b;
    if (a.front != b.front) return a.front > b.front;
    return a.block > b.block;
  }
};

class Factorisation {
 public:
  Factorisation(const multifrontal_tree &tree, const multifrontal_blas &blas,
                const int32_t *position, const int32_t *column, const int32_t *start,
                const int32_t *index, const double *data, double *factor, int32_t *pivoting,
                uint8_t *indefinite)
      : tree_(tree),
        dense_(blas),
        position_(position),
        column_(column),
        start_(start),
        index_(index),
        data_(data),
        factor_(factor),
        pivoting_(pivoting),
        indefinite_(indefinite),
        children_(tree.fronts),
        waiting_(tree.fronts, 0),
        places_(tree.fronts),
        across_(tree.fronts),
        updates_(tree.fronts),
        left_(tree.fronts) {
    for (int f = 0; f < tree.fronts; ++f) {
      if (tree.parent[f] >= 0) {
        children_[tree.parent[f]].push_back(f);
        ++waiting_[tree.parent[f]];
      }
    }
    for (int f = 0; f < tree.fronts; ++f) {
      if (waiting_[f] == 0) ready_.push({Task::kAssemble, f, 0});
    }
  }

  int run(int threads) {
    std::vector<std::thread> crew;
    try {
      for (int t = 1; t < threads; ++t) crew.emplace_back([this] { work(); });
    } catch (const std::system_error &) { /* no more threads to be had: fewer do it as well */
    }
    work();
    for (std::thread &one : crew) one.join();
    return status_;
  }

 private:
  int pivots(int f) const { return tree_.pivot[f + 1] - tree_.pivot[f]; }
  int rows(int f) const { return static_cast<int>(tree_.row_start[f + 1] - tree_.row_start[f]); }
  const int32_t *row(int f) const { return tree_.row + tree_.row_start[f]; }
  double *panel(int f) const { return factor_ + tree_.panel[f]; }
  static int blocks(int n) { return (n + kBlock - 1) / kBlock; }

  bool shared(int f) const {
    const double k = pivots(f), m = rows(f);
    return k * m * (k + m) / 2 > kWorthSharing && m > kBlock;
  }

  bool over() const { return status_ != MULTIFRONTAL_DONE || left_ == 0; }

  void work() {
    /* where each position is among the rows of the front at hand */
    std::vector<int32_t> local;
    try {
      local.resize(tree_.size);
    } catch (const std::bad_alloc &) {
      stop(MULTIFRONTAL_NO_MEMORY);
      return;
    }
    for (;;) {
      Task task;
      {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return over() || !ready_.empty(); });
        if (over()) return;
        task = ready_.top();
        ready_.pop();
      }
      try {
        perform(task, local);
      } catch (const std::bad_alloc &) {
        stop(MULTIFRONTAL_NO_MEMORY);
      }
    }
  }

  void perform(const Task &task, std::vector<int32_t> &local) {
    const int f = task.front;
    if (task.stage == Task::kAssemble) {
      assemble(f, local);
      if (!eliminate(f)) {
        stop(MULTIFRONTAL_SINGULAR);
      } else if (shared(f)) {
        share(f, Task::kPanel);
      } else {
        for (int b = 0; b < blocks(rows(f)); ++b) divide(f, b);
        for (int b = 0; b < blocks(rows(f)); ++b) update(f, b);
        finish(f);
      }
    } else if (task.stage == Task::kPanel) {
      divide(f, task.block);
      if (last_block(f)) share(f, Task::kUpdate);
    } else {
      update(f, task.block);
      if (last_block(f)) finish(f);
    }
  }

  /* The pivot columns of a front: entries of the matrix and what its children left. */
  void assemble(int f, std::vector<int32_t> &local) {
    const int k = pivots(f), m = rows(f), ld = k + m, first = tree_.pivot[f];
    double *a = panel(f);
    std::memset(a, 0, sizeof(double) * static_cast<size_t>(ld) * k);
    for (int i = 0; i < k; ++i) local[first + i] = i;
    for (int i = 0; i < m; ++i) local[row(f)[i]] = k + i;
    for (int j = 0; j < k; ++j) {
      double *into = a + static_cast<size_t>(ld) * j;
      const int32_t from = column_[first + j];
      for (int32_t e = start_[from]; e < start_[from + 1]; ++e) {
        const int32_t at = position_[index_[e]];
        if (at >= first + j) into[local[at]] = data_[e];
      }
    }
    for (int child : children_[f]) {
      const int n = rows(child);
      std::vector<int32_t> &place = places_[child];
      place.resize(n);
      for (int i = 0; i < n; ++i) place[i] = local[row(child)[i]];
      const double *u = updates_[child].get();
      for (int j = 0; j < n && place[j] < k; ++j) {
        double *into = a + static_cast<size_t>(ld) * place[j];
        const double *from = u + static_cast<size_t>(n) * j;
        for (int i = j; i < n; ++i) into[place[i]] += from[i];
      }
    }
    if (m) updates_[f] = pool_.take(static_cast<size_t>(m) * m);
  }

  /* Factors of the pivots; false where they are singular. */
  bool eliminate(int f) {
    const int k = pivots(f), m = rows(f), ld = k + m;
    double *a = panel(f);
    indefinite_[f] = 0;
    if (k == 0) return true;
    std::vector<double> before(static_cast<size_t>(k) * k);
    for (int j = 0; j < k; ++j) {
      std::memcpy(&before[static_cast<size_t>(k) * j], a + static_cast<size_t>(ld) * j,
                  sizeof(double) * k);
    }
    if (dense_.cholesky(k, a, ld)) return true;
    for (int j = 0; j < k; ++j) {
      std::memcpy(a + static_cast<size_t>(ld) * j, &before[static_cast<size_t>(k) * j],
                  sizeof(double) * k);
    }
    indefinite_[f] = 1;
    int32_t *pivots_at = pivoting_ + tree_.pivot[f];
    if (!dense_.pivoted(k, a, ld, pivots_at)) return false;
    for (int j = 0; j < k; ++j) {
      if (!(std::abs(a[static_cast<size_t>(ld) * j + j]) < 1e300)) return false;
    }
    std::vector<double> &across = across_[f];
    across.resize(static_cast<size_t>(k) * m);
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < k; ++j) {
        across[static_cast<size_t>(k) * i + j] = a[static_cast<size_t>(ld) * j + k + i];
      }
    }
    dense_.pivoted_solve(k, m, a, ld, pivots_at, across.data(), k);
    return true;
  }

  /* One block of the rows below positive definite pivots: L21 = A21 L11^-T. */
  void divide(int f, int block) {
    if (indefinite_[f]) return;
    const int k = pivots(f), ld = k + rows(f), from = kBlock * block;
    const int count = std::min(kBlock, rows(f) - from);
    dense_.divide_right(count, k, panel(f), ld, panel(f) + k + from, ld);
  }

  /* One block of columns of the Schur complement, what the children left included. */
  void update(int f, int block) {
    const int k = pivots(f), m = rows(f), ld = k + m;
    const int from = kBlock * block, to = std::min(from + kBlock, m), count = to - from;
    double *u = updates_[f].get();
    for (int j = from; j < to; ++j) {
      std::memset(u + static_cast<size_t>(m) * j + from, 0, sizeof(double) * (m - from));
    }
    for (int child : children_[f]) {
      const int n = rows(child);
      const std::vector<int32_t> &place = places_[child];
      int j = static_cast<int>(std::lower_bound(place.begin(), place.end(), k + from) - place.begin());
      for (; j < n && place[j] < k + to; ++j) {
        double *into = u + static_cast<size_t>(m) * (place[j] - k) - k;
        const double *add = updates_[child].get() + static_cast<size_t>(n) * j;
        for (int i = j; i < n; ++i) into[place[i]] += add[i];
      }
    }
    if (k == 0) return;
    const double *below = panel(f) + k;
    double *corner = u + static_cast<size_t>(m) * from + from;
    if (indefinite_[f]) {
      dense_.subtract_product("N", "N", m - from, count, k, below + from, ld,
                              &across_[f][static_cast<size_t>(k) * from], k, corner, m);
      return;
    }
    dense_.subtract_square(count, k, below + from, ld, corner, m);
    if (to < m) {
      dense_.subtract_product("N", "T", m - to, count, k, below + to, ld, below + from, ld,
                              corner + count, m);
    }
  }

  /* The front is done: its children's updates are used up, its parent may be ready. */
  void finish(int f) {
    for (int child : children_[f]) {
      const size_t n = rows(child);
      if (n) pool_.give(std::move(updates_[child]), n * n);
      std::vector<int32_t>().swap(places_[child]);
    }
    std::vector<double>().swap(across_[f]);
    std::lock_guard<std::mutex> lock(mutex_);
    const int parent = tree_.parent[f];
    if (parent >= 0 && --waiting_[parent] == 0) ready_.push({Task::kAssemble, parent, 0});
    --left_;
    changed_.notify_all();
  }

  void share(int f, Task::Stage stage) {
    std::lock_guard<std::mutex> lock(mutex_);
    waiting_[f] = blocks(rows(f));
    for (int b = 0; b < waiting_[f]; ++b) ready_.push({stage, f, b});
    changed_.notify_all();
  }

  bool last_block(int f) {
    std::lock_guard<std::mutex> lock(mutex_);
    return --waiting_[f] == 0;
  }

  void stop(int status) {
    std::lock_guard<std::mutex> lock(mutex_);
    status_ = status;
    changed_.notify_all();
  }

  const multifrontal_tree &tree_;
  const Dense dense_;
  const int32_t *position_, *column_, *start_, *index_;
  const double *data_;
  double *factor_;
  int32_t *pivoting_;
  uint8_t *indefinite_;
  std::vector<std::vector<int>> children_;
  std::vector<int> waiting_; /* children, later blocks, that are not done yet */
  std::vector<std::vector<int32_t>> places_; /* rows of a child among those of its parent */
  std::vector<std::vector<double>> across_;  /* A11^-1 A12 of indefinite fronts */
  std::vector<Pool::Block> updates_;
  Pool pool_;
  int left_;
  int status_ = MULTIFRONTAL_DONE;
  std::priority_queue<Task, std::vector<Task>, Later> ready_;
  std::mutex mutex_;
  std::condition_variable changed_;
};

}  // namespace

extern "C" int multifrontal_factorise(const multifrontal_tree *tree, const multifrontal_blas *blas,
                                      int32_t threads, const int32_t *position,
                                      const int32_t *column, const int32_t *start,
                                      const int32_t *index, const double *data, double *factor,
                                      int32_t *pivoting, uint8_t *indefinite) {
  try {
    return Factorisation(*tree, *blas, position, column, start, index, data, factor, pivoting,
                         indefinite)
        .run(threads);
  } catch (const std::bad_alloc &) {
    return MULTIFRONTAL_NO_MEMORY;
  }
}

extern "C" int multifrontal_solve(const multifrontal_tree *tree, const multifrontal_blas *blas,
                                  const double *factor, const int32_t *pivoting,
                                  const uint8_t *indefinite, int32_t columns, double *right) {
  const Dense dense(*blas);
  const int n = tree->size;
  int most = 0;
  for (int f = 0; f < tree->fronts; ++f) {
    most = std::max(most, static_cast<int>(tree->row_start[f + 1] - tree->row_start[f]) +
                              tree->pivot[f + 1] - tree->pivot[f]);
  }
  std::vector<double> work;
  try {
    work.resize(2 * static_cast<size_t>(most) * columns);
  } catch (const std::bad_alloc &) {
    return MULTIFRONTAL_NO_MEMORY;
  }
  double *own = work.data(), *other = own + static_cast<size_t>(most) * columns;
  const auto gather = [&](const int32_t *row, int m) {
    for (int c = 0; c < columns; ++c) {
      const double *from = right + static_cast<size_t>(n) * c;
      for (int i = 0; i < m; ++i) other[static_cast<size_t>(m) * c + i] = from[row[i]];
    }
  };
  for (int f = 0; f < tree->fronts; ++f) {
    const int first = tree->pivot[f], k = tree->pivot[f + 1] - first;
    const int m = static_cast<int>(tree->row_start[f + 1] - tree->row_start[f]), ld = k + m;
    const double *a = factor + tree->panel[f];
    const int32_t *row = tree->row + tree->row_start[f];
    double *y = right + first;
    if (k == 0) continue;
    const double *solved = y;
    int ld_solved = n;
    if (indefinite[f]) {
      for (int c = 0; c < columns; ++c) {
        std::memcpy(own + static_cast<size_t>(k) * c, y + static_cast<size_t>(n) * c,
                    sizeof(double) * k);
      }
      dense.pivoted_solve(k, columns, a, ld, pivoting + first, own, k);
      solved = own;
      ld_solved = k;
    } else {
      dense.divide_left(false, k, columns, a, ld, y, n);
    }
    if (m == 0) continue;
    dense.product("N", m, columns, k, a + k, ld, solved, ld_solved, other, m);
    for (int c = 0; c < columns; ++c) {
      double *into = right + static_cast<size_t>(n) * c;
      for (int i = 0; i < m; ++i) into[row[i]] -= other[static_cast<size_t>(m) * c + i];
    }
  }
  for (int f = tree->fronts - 1; f >= 0; --f) {
    const int first = tree->pivot[f], k = tree->pivot[f + 1] - first;
    const int m = static_cast<int>(tree->row_start[f + 1] - tree->row_start[f]), ld = k + m;
    const double *a = factor + tree->panel[f];
    double *y = right + first;
    if (k == 0) continue;
    if (m) {
      gather(tree->row + tree->row_start[f], m);
      dense.subtract_product("T", "N", k, columns, m, a + k, ld, other, m, y, n);
    }
    if (indefinite[f]) {
      dense.pivoted_solve(k, columns, a, ld, pivoting + first, y, n);
    } else {
      dense.divide_left(true, k, columns, a, ld, y, n);
    }
  }
  return MULTIFRONTAL_DONE;
}

// SPDX-License-Identifier: Apache-2.0
// Runs work on several threads: those of TBB (parallel_tbb.cpp), or plain ones if GSC_WITH_TBB is off
// (parallel_threads.cpp). No other code of the stages deals with threads. The results of a stage must not depend on how
// work is spread over the workers.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace gsc {

class Workers {
public:
    explicit Workers(int threads); // number of threads, 0 = all cores
    ~Workers();
    Workers(const Workers&) = delete;
    Workers& operator=(const Workers&) = delete;

    [[nodiscard]] int count() const { return m_count; }

    using Body = std::function<void(size_t begin, size_t end, int worker)>;

    // Calls body(begin, end, worker) for disjoint ranges that cover [0, count). Each range has at most `grain` items,
    // except that a single worker may get all items at once. 0 <= worker < count(); a worker runs one range at a time.
    // Exceptions of a body are thrown to the caller, and no range is begun after one. A body must not call run()
    // itself.
    void run(size_t count, size_t grain, const Body& body) const;

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
    int m_count;
};

} // namespace gsc

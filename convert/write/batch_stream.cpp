// SPDX-License-Identifier: Apache-2.0
#include "convert/write/batch_stream.h"

#include <gsc/interrupt.h>
#include "kernels/threads/tbb_bound.h"

#include <tbb/concurrent_queue.h>
#include <tbb/parallel_pipeline.h>

#include <array>

namespace gsc {

void forEachBatch(AnchorSource& source, uint32_t fields, const std::function<void(const AnchorBatch&)>& work)
{
    constexpr size_t kBatches = 3; // one batch is filled, one is worked on, one waits
    std::array<AnchorBatch, kBatches> batches;
    tbb::concurrent_queue<AnchorBatch*> unused;
    for (AnchorBatch& batch : batches)
        unused.push(&batch);

    boundTbb();
    source.rewind();
    const auto read = [&](tbb::flow_control& control) -> AnchorBatch* {
        throwIfInterrupted();
        AnchorBatch* batch = nullptr;
        // note: the queue is never empty here, since at most kBatches batches are in the pipeline
        if (!unused.try_pop(batch) || !source.next(*batch, fields, kBatchRows)) {
            control.stop();
            return nullptr;
        }
        return batch;
    };
    const auto process = [&](AnchorBatch* batch) {
        work(*batch);
        unused.push(batch);
    };
    tbb::parallel_pipeline(kBatches,
                           tbb::make_filter<void, AnchorBatch*>(tbb::filter_mode::serial_in_order, read) &
                               tbb::make_filter<AnchorBatch*, void>(tbb::filter_mode::serial_in_order, process));
}

} // namespace gsc

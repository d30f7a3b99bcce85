// SPDX-License-Identifier: Apache-2.0
// One view taken through the stages, so that a benchmark can repeat any of them on the input it has in a frame.
#pragma once

#include "runtime/cpu/frame_cpu.h"

#include <memory>
#include <vector>

namespace gsc::bench {

class BenchScene {
public:
    // `model` must outlive the scene. `appearance` as in FrameOptions.
    BenchScene(const ModelView& model, const EyeParams& eye, int32_t appearance);

    // Each repeats one stage and returns a number that depends on all of its work.
    size_t decodeFast(const Workers& workers);
    size_t decodeReference();
    uint64_t blendFast(const Workers& workers);
    uint64_t blendReferenceSameLists(); // the lists the fast path made: arithmetic alone
    uint64_t blendReferenceFullLists(); // every tile of upstream's rectangles: what culling saves, too

    [[nodiscard]] size_t visible() const { return m_frame.visible_count; }
    [[nodiscard]] size_t gaussians() const { return m_gaussians; }
    [[nodiscard]] uint64_t pairs() const { return m_pairs; }
    // Largest difference between the fast image and the reference's: a benchmark of something wrong is worth nothing.
    [[nodiscard]] float worstDifference() const;

private:
    void listAll();
    void buildReference();

    const ModelView& m_model;
    EyeParams m_eye;
    int32_t m_appearance;
    RasterConstants m_rules;
    CpuFrame m_frame;
    size_t m_gaussians = 0;
    uint64_t m_pairs = 0;
    std::vector<std::unique_ptr<DecodeScratch>> m_scratch; // per worker
    std::vector<SelectedAnchor<float>> m_selected;
    std::vector<SplatOf<float>> m_full_splats, m_same_splats;
    TileLists m_full_lists, m_same_lists;
    std::vector<float> m_image, m_reference_image;
};

} // namespace gsc::bench

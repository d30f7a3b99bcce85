// SPDX-License-Identifier: Apache-2.0
// An opened .gsc file, mapped, ready for a backend.
#pragma once

#include <gsc/frame_types.h>
#include <gsc/source_camera.h>

#include <memory>
#include <string>
#include <vector>

namespace gsc {

class GscFile;

class Scene {
public:
    // Maps `path` and checks header, table and every record the stages rely on; chunk payloads are checked too if
    // `verify_payloads`. Throws Error (Io, InvalidFile, Unsupported); the message holds the first issue.
    static std::unique_ptr<Scene> open(const std::string& path, bool verify_payloads = false);
    // open(path) for a file that is open already and sound: it is mapped or decoded once. `name` is for messages.
    static std::unique_ptr<Scene> open(std::shared_ptr<const GscFile> file, const std::string& name,
                                       bool verify_payloads = false);
    virtual ~Scene() = default;

    // Relative to ModelView::origin where the model lies far from the world's (local_model.h).
    [[nodiscard]] virtual const ModelView& view() const = 0;
    [[nodiscard]] virtual const std::string& manifest() const = 0; // JSON text of META
    [[nodiscard]] virtual const std::vector<SourceCamera>& cameras() const = 0;
    // Row of EMBD that holds the trainer's row `source_row`. Throws Error(Usage) naming the rows there are.
    [[nodiscard]] virtual int appearanceRow(int source_row) const = 0;
    // The trainer's rows that EMBD holds, ascending; empty if the model has no embedding.
    [[nodiscard]] virtual std::vector<uint32_t> appearanceRows() const = 0;
    [[nodiscard]] virtual uint64_t anchorCount() const = 0;
    [[nodiscard]] virtual uint64_t bytes() const = 0;
};

} // namespace gsc

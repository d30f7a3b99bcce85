// SPDX-License-Identifier: Apache-2.0
// An opened .gsc file, mapped into memory and ready for a renderer.
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
    // Maps the file at `path` and checks header, section table and every record that the stages rely on; with
    // `verify_payloads` also the chunks' payloads. Throws Error (Io, InvalidFile, Unsupported); the message names the
    // first issue.
    static std::unique_ptr<Scene> open(const std::string& path, bool verify_payloads = false);
    // Does as open(path), for a file that is open already and has no issue, so that it is mapped or decoded only once.
    // `name` names the file in messages.
    static std::unique_ptr<Scene> open(std::shared_ptr<const GscFile> file, const std::string& name,
                                       bool verify_payloads = false);
    virtual ~Scene() = default;

    // Returns the model. Its positions are relative to ModelView::origin if the model lies far from the world's origin
    // (local_model.h).
    [[nodiscard]] virtual const ModelView& view() const = 0;
    [[nodiscard]] virtual const std::string& manifest() const = 0; // JSON text of the section META
    [[nodiscard]] virtual const std::vector<SourceCamera>& cameras() const = 0;
    // Returns the row of the section EMBD that holds row `source_row` of the trainer's embedding. Throws Error(Usage)
    // if there is none, naming the rows that there are.
    [[nodiscard]] virtual int appearanceRow(int source_row) const = 0;
    // Returns the numbers of the trainer's rows that EMBD holds, ascending; empty if the model has no embedding.
    [[nodiscard]] virtual std::vector<uint32_t> appearanceRows() const = 0;
    [[nodiscard]] virtual uint64_t anchorCount() const = 0;
    [[nodiscard]] virtual uint64_t bytes() const = 0;
};

} // namespace gsc

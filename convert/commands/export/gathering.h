// SPDX-License-Identifier: Apache-2.0
// Collects the fitted Gaussians of an export, part by part, in memory or in a PLY that is larger than memory.
#pragma once

#include "convert/commands/export/measure_gaussians.h"
#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include <gsc/interrupt.h>
#include "convert/export/gaussian_files.h"
#include "runtime/cpu/renderer_cpu.h"

#include <new>
#include <optional>

namespace gsc {

// Collects the fitted Gaussians. A PLY may become larger than memory: then its rows are written as they come, the
// Gaussians are not kept, and no loss is measured.
class Gathering {
public:
    // `choice`: levels to keep; none: they are chosen later from all, so rows are written once memory is short
    Gathering(const GaussianExportOptions& options, int degree, const std::optional<LevelSet>& choice,
              OutputFile* output)
        : m_degree(degree), m_is_ply(options.to == GaussianFileFormat::Ply), m_choice(choice),
          m_budget(options.memory_budget > 0 ? options.memory_budget : cpuFacts(1).memory_bytes / 2)
    {
        set.degree = degree;
        if (options.to != GaussianFileFormat::Ply || options.most < std::numeric_limits<uint64_t>::max())
            return;
        m_output = output;
        if (choice)
            start();
    }

    void add(GaussianSet&& part)
    {
        fitted += part.size();
        if (m_choice)
            keepLevels(part, *m_choice);
        count += part.size();
        if (m_started)
            writeRows(part);
        const uint64_t each = (12 + 3 * shValues(m_degree)) * sizeof(float);
        if (whole && count * each <= m_budget && keep(part))
            return;
        if (m_output == nullptr)
            throw Error(
                ErrorCode::OutOfMemory, "export",
                formatString("more than %llu Gaussians", (unsigned long long)(m_budget / each)),
                "as many as memory holds",
                formatString("choose %s, a lower --sh, fewer cameras with --cameras, or a smaller model (gsc bake)",
                             m_is_ply ? "no --max-gaussians" : "--to ply"));
        if (!m_started) {
            start();
            writeRows(set);
            writeRows(part);
        }
        whole = false;
        set = {};
    }

    // Writes the PLY header again, with the number of Gaussians. Call after the last part.
    void finish() const
    {
        const std::string header = gaussianPlyHeader(m_degree, count);
        m_output->writeAt(0, std::as_bytes(std::span(header)));
    }

    GaussianSet set;
    uint64_t fitted = 0, count = 0, written = 0; // number of Gaussians fitted, and kept; number of bytes
    bool whole = true;                           // false if `set` could not keep them all

private:
    void start()
    {
        m_started = true;
        const std::string header = gaussianPlyHeader(m_degree, 0);
        write(std::as_bytes(std::span(header)));
    }

    void writeRows(const GaussianSet& part)
    {
        writeGaussianPlyRows(part, [this](std::span<const std::byte> piece) { write(piece); });
    }

    // Appends `part` to `set`; returns false if memory is too short and rows can be written to a PLY.
    bool keep(const GaussianSet& part)
    {
        try {
            append(set, part);
            return true;
        } catch (const std::bad_alloc&) {
            if (m_output == nullptr)
                throw;
            return false;
        }
    }

    void write(std::span<const std::byte> piece)
    {
        throwIfInterrupted();
        m_output->write(piece);
        written += piece.size();
    }

    int m_degree;
    bool m_is_ply;
    std::optional<LevelSet> m_choice;
    uint64_t m_budget;
    OutputFile* m_output = nullptr; // PLY that may have more rows than memory; null = there is none
    bool m_started = false;         // rows are written as they come
};

} // namespace gsc

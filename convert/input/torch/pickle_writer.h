// SPDX-License-Identifier: Apache-2.0
// Writes pickles, as PyTorch writes them.
#pragma once

#include "convert/input/torch/zip_writer.h"
#include <gsc/error.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// Writes protocol 2. A string or a global that was written before is written as a reference to the memo, as PyTorch
// does, even where the key of a storage happens to equal the name of a module.
class PickleWriter {
public:
    PickleWriter() { m_bytes = {'\x80', 2}; }

    // Writes opcodes, one a letter: ( mark, ) empty tuple, t tuple, } empty dictionary, s item, u items, R call, Q
    // storage, \x81 new object, b its state, N None, . end.
    void ops(const char* opcodes) { m_bytes += opcodes; }

    void string(const std::string& text)
    {
        if (!pooled('X' + text)) {
            ops("X");
            little(text.size(), 4);
            m_bytes += text;
            memoize('X' + text);
        }
    }

    void global(const std::string& module, const std::string& name)
    {
        const std::string key = 'c' + module + '\n' + name + '\n';
        if (!pooled(key)) {
            m_bytes += key;
            memoize(key);
        }
    }

    void integer(uint64_t value)
    {
        const size_t bytes = value < 256 ? 1 : value < 65536 ? 2 : 4;
        ops(bytes == 1 ? "K" : bytes == 2 ? "M" : "J");
        little(value, bytes);
    }

    void tensor(std::span<const float> values, const std::vector<uint64_t>& shape, bool requires_grad)
    {
        uint64_t count = 1;
        for (const uint64_t size : shape)
            count *= size;
        if (values.size() != count || count >= (uint64_t(1) << 31))
            throw internalError("tensor", formatString("%zu values", values.size()),
                                formatString("the %llu of its shape", static_cast<unsigned long long>(count)));
        global("torch._utils", "_rebuild_tensor_v2");
        ops("((");
        string("storage");
        global("torch", "FloatStorage");
        const std::string key = std::to_string(m_storages.size());
        string(key);
        string("cuda:0");
        integer(count);
        ops("tQ");
        put();
        integer(0);
        ops("(");
        for (const uint64_t size : shape)
            integer(size);
        ops("t(");
        uint64_t stride = count;
        for (const uint64_t size : shape) {
            stride = size == 0 ? 1 : stride / size;
            integer(stride);
        }
        ops("t");
        boolean(requires_grad);
        global("collections", "OrderedDict");
        ops(")RtR");
        put();
        m_storages.emplace(key, values);
    }

    void boolean(bool value) { ops(value ? "\x88" : "\x89"); }
    void put() { memoize({}); } // gives the value on top of the stack the next slot of the memo
    [[nodiscard]] const std::string& bytes() const { return m_bytes; }

    void addStorages(ZipWriter& zip) const
    {
        for (const auto& [key, values] : m_storages)
            zip.add("data/" + key, std::as_bytes(values));
    }

private:
    void little(uint64_t value, size_t count)
    {
        for (size_t i = 0; i < count; ++i)
            m_bytes += char(value >> (8 * i));
    }

    bool pooled(const std::string& key)
    {
        const auto found = m_slots.find(key);
        if (found != m_slots.end())
            slot("h", "j", found->second);
        return found != m_slots.end();
    }

    void memoize(const std::string& key)
    {
        slot("q", "r", m_next);
        if (!key.empty())
            m_slots.emplace(key, m_next);
        ++m_next;
    }

    void slot(const char* opcode, const char* long_opcode, uint32_t number)
    {
        ops(number < 256 ? opcode : long_opcode);
        little(number, number < 256 ? 1 : 4);
    }

    std::string m_bytes;
    std::map<std::string, uint32_t> m_slots;
    uint32_t m_next = 0;
    std::map<std::string, std::span<const float>> m_storages; // ordered as text: 0, 1, 10, 11, 2
};

} // namespace gsc

// SPDX-License-Identifier: Apache-2.0
// A window made with GLFW, and its input.
#pragma once

#include "player/present/presenter.h"

#define GLFW_INCLUDE_NONE
#define GLFW_INCLUDE_VULKAN
#include <GLFW/glfw3.h>

#include <functional>
#include <string>
#include <vector>

namespace gsc {

class GlfwWindow {
public:
    // Opens a window of `width` x `height` pixels. Throws Error(Unsupported) if there is no display.
    GlfwWindow(const std::string& title, uint32_t width, uint32_t height);
    ~GlfwWindow();
    GlfwWindow(const GlfwWindow&) = delete;
    GlfwWindow& operator=(const GlfwWindow&) = delete;

    // Returns the input since the last call; waits up to `seconds` for some. Throws Error(Device) if the display has
    // gone.
    WindowInput poll(double seconds);
    VkSurfaceKHR makeSurface(VkInstance instance); // makes a Vulkan surface of the window; throws Error(Device)
    [[nodiscard]] GLFWwindow* handle() const { return m_window; }
    [[nodiscard]] float scale() const;
    void toggleFullScreen(); // covers the screen, or gives the window the place and size that it had before
    // For destructors: calls `end`, which needs the display, unless the display has gone.
    static void unlessGone(const std::function<void()>& end);

private:
    void add(const InputEvent& event) { m_events.push_back(event); }
    static GlfwWindow& of(GLFWwindow* window) { return *static_cast<GlfwWindow*>(glfwGetWindowUserPointer(window)); }

    GLFWwindow* m_window = nullptr;
    std::vector<InputEvent> m_events;
    std::vector<std::string> m_dropped;
    int m_place[4] = {}; // left, top, width and height of the window before it covered the screen
    bool m_exposed = true;
};

// Returns the names of the Vulkan instance extensions that surfaces need. Precondition: a GlfwWindow was made.
std::vector<const char*> surfaceExtensions();

} // namespace gsc

# Wraps Debian's Bullet in one target, layfigure::bullet: its CMake config sets old-style variables only, and says
# nothing of the precision that the library was built with.
find_package(Bullet 3.24 REQUIRED)
add_library(layfigure_bullet INTERFACE)
add_library(layfigure::bullet ALIAS layfigure_bullet)
target_include_directories(layfigure_bullet SYSTEM INTERFACE ${BULLET_ROOT_DIR}/${BULLET_INCLUDE_DIR})
target_link_libraries(layfigure_bullet INTERFACE BulletDynamics BulletCollision LinearMath)
